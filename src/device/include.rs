//! Kernel files and their `#include` lines, joined to one text.
//!
//! OpenCL's own includes need folders, which a binary with embedded kernels does not have, and opencl3 crashes on programs of several strings. So a
//! program's text is complete before the compiler reads it. Each file is included once, at its first mention.

use std::path::Path;

use include_dir::{Dir, include_dir};

use crate::error::{Error, Result};

static KERNELS: Dir = include_dir!("$CARGO_MANIFEST_DIR/kernels");

/// Reads a kernel file from the folder `overrides`, or else from the binary.
///
/// # Errors
/// [`Error::Internal`] if there is no such file.
pub(super) fn read(overrides: Option<&Path>, name: &str) -> Result<String> {
    if let Some(folder) = overrides {
        let text = std::fs::read_to_string(folder.join(name));
        return text.map_err(|e| Error::internal(format!("kernel file {name}: {e}")));
    }
    let file = KERNELS.get_file(name).and_then(|file| file.contents_utf8());
    file.map(str::to_owned).ok_or_else(|| Error::internal(format!("kernel file {name} is not in the binary")))
}

/// Joins the file `main` and all its includes. `#line` tells the compiler the file of each part.
///
/// # Errors
/// [`Error::Internal`] for an included file that is missing, includes itself, or is included under a condition.
pub(super) fn assemble(main: &str, read: &dyn Fn(&str) -> Result<String>) -> Result<String> {
    let mut assembly = Assembly { read, taken: Vec::new(), open: Vec::new(), text: String::new() };
    assembly.take(main)?;
    Ok(assembly.text)
}

struct Assembly<'a> {
    read: &'a dyn Fn(&str) -> Result<String>,
    /// The files in the text so far.
    taken: Vec<String>,
    /// The file that is being included, after the files that include it.
    open: Vec<String>,
    text: String,
}

impl Assembly<'_> {
    fn take(&mut self, name: &str) -> Result<()> {
        let content = (self.read)(name).map_err(|e| match self.open.last() {
            Some(by) => Error::internal(format!("{e}, included by kernels/{by}")),
            None => e,
        })?;
        self.taken.push(name.to_owned());
        self.open.push(name.to_owned());
        self.text += &format!("#line 1 \"kernels/{name}\"\n");
        // The guard of a header is the only condition that may enclose an include. Any other condition would hold for the first file that includes
        // the header, and so for all others.
        let permitted_depth = usize::from(name.ends_with(".h"));
        let mut depth = 0usize;
        for (line, number) in content.lines().zip(1..) {
            match directive(line) {
                Some(("if" | "ifdef" | "ifndef", _)) => depth += 1,
                Some(("endif", _)) => depth = depth.saturating_sub(1),
                Some(("include", rest)) => {
                    let at = format!("kernels/{name}, line {number}");
                    if depth > permitted_depth {
                        return Err(Error::internal(format!("{at}: an include under a condition")));
                    }
                    self.include(rest, &at)?;
                    self.text += &format!("#line {} \"kernels/{name}\"\n", number + 1);
                    continue;
                }
                _ => {}
            }
            self.text += line;
            self.text.push('\n');
        }
        self.open.pop();
        Ok(())
    }

    fn include(&mut self, quoted: &str, at: &str) -> Result<()> {
        let Some(name) = quoted.trim().strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) else {
            return Err(Error::internal(format!("{at}: an include names a file in quotes, from kernels/ on")));
        };
        if self.open.iter().any(|file| file == name) {
            let circle = self.open.join(" includes ");
            return Err(Error::internal(format!("{at}: a circle of includes: {circle} includes {name}")));
        }
        if self.taken.iter().any(|file| file == name) { Ok(()) } else { self.take(name) }
    }
}

/// The preprocessor directive of a line, and the rest of the line.
fn directive(line: &str) -> Option<(&str, &str)> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start();
    Some(rest.split_at(rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(rest.len())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text of `a.cl` among files.
    fn assembled(files: &[(&str, &str)]) -> std::result::Result<String, String> {
        let read = |name: &str| {
            let found = files.iter().find(|(known, _)| *known == name);
            found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| Error::internal(format!("{name} is not there")))
        };
        assemble("a.cl", &read).map_err(|e| e.to_string())
    }

    #[test]
    fn a_file_is_taken_once_and_lines_are_those_of_their_files() {
        let text = assembled(&[
            ("a.cl", "// A\n#include \"b.h\"\n#include \"c.h\"\nend\n"),
            ("b.h", "#ifndef B_H\n#include \"c.h\"\nb\n#endif\n"),
            ("c.h", "c\n"),
        ]);
        let expected = "#line 1 \"kernels/a.cl\"\n// A\n#line 1 \"kernels/b.h\"\n#ifndef B_H\n#line 1 \"kernels/c.h\"\nc\n\
            #line 3 \"kernels/b.h\"\nb\n#endif\n#line 3 \"kernels/a.cl\"\n#line 4 \"kernels/a.cl\"\nend\n";
        assert_eq!(text.as_deref(), Ok(expected));
    }

    #[test]
    fn a_missing_file_is_named_with_the_one_that_includes_it() {
        let said = assembled(&[("a.cl", "#include \"b.h\"\n")]).expect_err("b.h is missing");
        assert!(said.contains("b.h is not there") && said.contains("included by kernels/a.cl"), "{said}");
        assert!(assembled(&[]).is_err(), "a.cl itself is missing");
    }

    #[test]
    fn a_circle_is_named() {
        let files = [("a.cl", "#include \"b.h\"\n"), ("b.h", "\n#include \"c.h\"\n"), ("c.h", "#include \"b.h\"\n")];
        let said = assembled(&files).expect_err("b.h includes itself");
        let circle = "kernels/c.h, line 1: a circle of includes: a.cl includes b.h includes c.h includes b.h";
        assert!(said.contains(circle), "{said}");
    }

    #[test]
    fn an_include_under_a_condition_is_refused() {
        let header = "#ifndef B_H\n#if X\n#include \"c.h\"\n#endif\n#endif\n";
        let said = assembled(&[("a.cl", "#include \"b.h\"\n"), ("b.h", header), ("c.h", "")]).expect_err("it is");
        assert!(said.contains("kernels/b.h, line 3"), "{said}");
        assert!(assembled(&[("a.cl", "#if X\n#include \"c.h\"\n#endif\n"), ("c.h", "")]).is_err());
        assert!(assembled(&[("a.cl", "#include <c.h>\n"), ("c.h", "")]).is_err(), "not in quotes");
    }

    /// The rule ensures that no header depends on an include of another file before it.
    #[test]
    fn every_header_has_a_guard_and_every_include_stands_at_the_top() {
        let folders = [Some(&KERNELS), KERNELS.get_dir("shared")];
        let files: Vec<_> = folders.into_iter().flatten().flat_map(Dir::files).collect();
        let mut headers = 0;
        for file in files {
            if file.path().extension().is_some_and(|e| e == "md") {
                continue;
            }
            let (path, text) = (file.path().display().to_string(), file.contents_utf8().expect("UTF-8"));
            let code: Vec<&str> = text.lines().filter(|l| !l.is_empty() && !l.starts_with("//")).collect();
            let mut code = code.as_slice();
            if let Some(name) = path.strip_prefix("shared/").and_then(|p| p.strip_suffix(".h")) {
                let guard = format!("SHARED_{}_H", name.to_uppercase());
                let opened = [format!("#ifndef {guard}"), format!("#define {guard}")];
                assert!(code.len() > 3 && code[..2] == opened && code[code.len() - 1] == "#endif", "{path}: no guard");
                code = &code[2..code.len() - 1];
                headers += 1;
            }
            let includes = code.iter().take_while(|l| l.starts_with("#include \"shared/")).count();
            assert!(code[includes..].iter().all(|l| !l.contains("#include")), "{path}: an include below code");
            assert!(code[..includes].windows(2).all(|w| w[0] < w[1]), "{path}: includes are not in order");
        }
        assert!(headers > 20, "{headers} headers were looked at");
    }
}
