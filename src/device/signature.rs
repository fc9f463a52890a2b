//! The parameters of a kernel function by name, as its text declares them.
//!
//! OpenCL knows arguments by number only. It gives their names only if a program is built with `-cl-kernel-arg-info`, which not every driver honours.
//! The text is the same everywhere.

use crate::error::{Error, Result};

/// A parameter of a kernel function; each of them is a buffer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Its name in the function.
    pub name: String,
    /// True for a volume's voxels (`VOLUME`), which may be an image.
    pub is_volume: bool,
}

/// The words and signs of a text without comments; a preprocessor directive is a single `#`.
fn tokens(text: &str) -> Vec<&str> {
    let (mut found, mut rest, mut line_begins) = (Vec::new(), text, true);
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let length = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if first == '#' && line_begins {
            found.push("#");
            directive_length(rest)
        } else if is_word(first) {
            rest.find(|c| !is_word(c)).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (token, after) = rest.split_at(length);
        if is_word(first) || first.is_ascii_punctuation() && length == 1 {
            found.push(token);
        }
        line_begins = first == '\n' || line_begins && first.is_whitespace();
        rest = after;
    }
    found
}

/// The length of a directive. It ends with its line, unless that is continued.
fn directive_length(text: &str) -> usize {
    let mut from = 0;
    while let Some(end) = text[from..].find('\n') {
        if !text[from..from + end].ends_with('\\') {
            return from + end;
        }
        from += end + 1;
    }
    text.len()
}

/// The number of tokens that the parentheses at the beginning enclose, including the parentheses.
fn enclosed(tokens: &[&str]) -> usize {
    let mut depth = 0;
    let closes = |token: &&str| {
        depth += i32::from(*token == "(") - i32::from(*token == ")");
        depth == 0
    };
    tokens.iter().position(closes).map_or(tokens.len(), |at| at + 1)
}

/// The parameters of the kernel function `function` in a program's text, in order.
///
/// # Errors
/// [`Error::Internal`] if there is no such function, or its parameters depend on a condition or have no names.
pub(super) fn parameters(text: &str, function: &str) -> Result<Vec<Parameter>> {
    let tokens = tokens(text);
    let kernels = (0..tokens.len()).filter(|&i| ["kernel", "__kernel"].contains(&tokens[i])).map(|i| &tokens[i + 1..]);
    for mut rest in kernels {
        if let ["__attribute__", after @ ..] = rest {
            rest = &after[enclosed(after)..];
        }
        if let ["void", name, list @ ..] = rest
            && *name == function
            && list.first() == Some(&"(")
        {
            return parameters_of_list(function, &list[1..enclosed(list) - 1]);
        }
    }
    Err(Error::internal(format!("there is no kernel function {function} in its file")))
}

fn parameters_of_list(function: &str, list: &[&str]) -> Result<Vec<Parameter>> {
    if list.contains(&"#") {
        return Err(Error::internal(format!("the parameters of {function} depend on a condition")));
    }
    let mut parameters = Vec::<Parameter>::new();
    for one in list.split(|token| *token == ",") {
        let name = one.last().filter(|name| one.len() > 1 && !name.starts_with(|c: char| c.is_ascii_punctuation()));
        let name = name.ok_or_else(|| Error::internal(format!("a parameter of {function} has no name: {one:?}")))?;
        if parameters.iter().any(|known| known.name == *name) {
            return Err(Error::internal(format!("two parameters of {function} are called {name}")));
        }
        parameters.push(Parameter { name: (*name).to_owned(), is_volume: one.contains(&"VOLUME") });
    }
    Ok(parameters)
}

/// The index of each of the arguments `names` among the parameters. There are few of them, so a search costs less than hashing a name.
///
/// # Errors
/// [`Error::Internal`] naming an argument that is unknown or doubled, or a parameter without an argument.
pub(super) fn places<'a>(parameters: &[Parameter], names: impl Iterator<Item = &'a str>) -> Result<Vec<usize>> {
    let mut places = Vec::with_capacity(parameters.len());
    for name in names {
        let place = parameters.iter().position(|p| p.name == name);
        let place = place.ok_or_else(|| Error::internal(format!("there is no parameter {name}")))?;
        if places.contains(&place) {
            return Err(Error::internal(format!("the argument {name} is given twice")));
        }
        places.push(place);
    }
    match (0..parameters.len()).find(|place| !places.contains(place)) {
        Some(missing) => Err(Error::internal(format!("the argument {} is missing", parameters[missing].name))),
        None => Ok(places),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "// kernel void first(global int *commented)\n/* kernel void first(int also) */\n\
        #define MACRO(x) \\\n  kernel void first(x)\n\
        typedef struct { int kernel_of; } View;\nstatic void first(global int *plain) {}\n\
        kernel void first(constant View *view, VOLUME voxels, // the volume\n  global const float *table) {}\n\
        __kernel __attribute__((reqd_work_group_size(4, 1, 1))) void second(global int *out) {}\n\
        kernel void third(\n#if X\nglobal int *a\n#else\nglobal int *b\n#endif\n) {}\n\
        kernel void fourth(global int *) {}\nkernel void fifth(global int *a, global int *a) {}\n";

    fn names(function: &str) -> Vec<String> {
        parameters(TEXT, function).expect(function).into_iter().map(|p| p.name).collect()
    }

    #[test]
    fn parameters_are_those_of_the_function_in_their_order() {
        assert_eq!(names("first"), ["view", "voxels", "table"]);
        assert_eq!(names("second"), ["out"]);
        let first = parameters(TEXT, "first").expect("it is there");
        assert_eq!(first.iter().map(|p| p.is_volume).collect::<Vec<_>>(), [false, true, false]);
    }

    #[test]
    fn parameters_that_cannot_be_told_are_errors() {
        for (function, word) in [
            ("third", "condition"),
            ("fourth", "no name"),
            ("fifth", "two parameters of fifth are called a"),
            ("View", "no kernel function View"),
        ] {
            let said = parameters(TEXT, function).expect_err(function).to_string();
            assert!(said.contains(word), "{said}");
        }
    }

    #[test]
    fn arguments_go_where_their_names_are_and_wrong_ones_are_named() {
        let parameters = parameters(TEXT, "first").expect("it is there");
        let of = |names: &[&str]| places(&parameters, names.iter().copied()).map_err(|e| e.to_string());
        assert_eq!(of(&["table", "view", "voxels"]), Ok(vec![2, 0, 1]));
        for (names, said) in [
            (&["table", "view", "film"][..], "there is no parameter film"),
            (&["table", "view", "table"], "the argument table is given twice"),
            (&["table", "view"], "the argument voxels is missing"),
        ] {
            assert!(of(names).is_err_and(|e| e.contains(said)), "{names:?}");
        }
    }
}
