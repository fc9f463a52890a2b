//! Levels of processors, and a compiler of kernels for any of them: clang of PoCL's LLVM, with the options that PoCL passes.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The common properties of the processors of a level.
#[derive(Debug)]
pub struct Level {
    pub name: &'static str,
    /// The number of lanes, which fill a vector.
    pub lanes: u32,
    triple: &'static str,
    /// The processor that PoCL compiles for at this level.
    pub cpu: &'static str,
}

const X86: &str = "x86_64-pc-linux-gnu";

/// The levels of each kind of processor, from the widest vectors to the narrowest.
pub const LEVELS: [Level; 5] = [
    Level { name: "AVX-512", lanes: 16, triple: X86, cpu: "skylake-avx512" },
    Level { name: "AVX2", lanes: 8, triple: X86, cpu: "haswell" },
    Level { name: "AVX", lanes: 8, triple: X86, cpu: "sandybridge" },
    Level { name: "SSE4", lanes: 4, triple: X86, cpu: "penryn" },
    Level { name: "ARM64", lanes: 4, triple: "aarch64-linux-gnu", cpu: "cortex-a72" },
];

/// The headers of PoCL, which are included before every kernel.
const HEADERS: &str = "/usr/share/pocl/include";

/// The options that PoCL 3.1 passes to its compiler for every kernel (`POCL_DEBUG=all` shows them), less the program's own options and the target.
const OPTIONS: &str = "-cc1 -x cl -Dcl_khr_int64 -DPOCL_DEVICE_ADDRESS_BITS=64 -D__USE_CLANG_OPENCL_C_H -Dinline= \
    -cl-kernel-arg-info -D__ENDIAN_LITTLE__=1 -D__IMAGE_SUPPORT__=1 -DCL_DEVICE_MAX_GLOBAL_VARIABLE_SIZE=0 \
    -D__OPENCL_VERSION__=300 -D__OPENCL_C_VERSION__=120 -fno-builtin";
const EXTENSIONS: [&str; 11] = [
    "cl_khr_byte_addressable_store",
    "cl_khr_global_int32_base_atomics",
    "cl_khr_global_int32_extended_atomics",
    "cl_khr_local_int32_base_atomics",
    "cl_khr_local_int32_extended_atomics",
    "cl_khr_3d_image_writes",
    "cl_khr_command_buffer",
    "cl_khr_spir",
    "cl_khr_int64_base_atomics",
    "cl_khr_int64_extended_atomics",
    "cl_khr_fp64",
];

/// A clang and a folder of the programs that it is known to compile.
pub struct Compiler {
    program: String,
    version: String,
    kept: PathBuf,
}

impl Compiler {
    /// The compiler for a PoCL with this version text, such as `OpenCL 3.0 PoCL 3.1+debian … LLVM 15.0.6, …`.
    pub fn of(platform_version: &str) -> Self {
        let number = platform_version.split("LLVM ").nth(1).and_then(|rest| rest.split('.').next());
        let program = format!("clang-{}", number.unwrap_or_else(|| panic!("no LLVM in {platform_version}")));
        let output = Command::new(&program).arg("--version").output();
        let output = output.unwrap_or_else(|e| panic!("{program}, to compile for other processors: {e}"));
        let version = format!("{platform_version}\n{}", String::from_utf8_lossy(&output.stdout));
        let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("levels");
        std::fs::create_dir_all(&kept).unwrap();
        Self { program, version, kept }
    }

    /// Compiles to the level's assembly. Clang gives some messages only while it makes code, such as that a vector is too wide to be passed
    /// (`-Wpsabi`), and the level's instructions are chosen last of all. It does not optimise, which would take twice as long.
    ///
    /// # Errors
    /// The compiler's message.
    pub fn compile(&self, level: &Level, options: &str, text: &str) -> Result<(), String> {
        let extensions: String = EXTENSIONS.iter().map(|e| format!(",+{e}")).collect();
        let mut front: Vec<String> = OPTIONS.split_whitespace().map(str::to_owned).collect();
        front.extend(EXTENSIONS.map(|e| format!("-D{e}=1")));
        front.push(format!("-cl-ext=-all{extensions}"));
        front.extend(["-I", HEADERS, "-include", "_kernel.h"].map(str::to_owned));
        front.extend(options.split_whitespace().map(str::to_owned));
        let code = self.run(level, front.into_iter().chain(["-emit-llvm".into()]), text.as_bytes())?;
        // Only some back ends know how to call a kernel. PoCL also makes it a plain function before it gets there.
        let plain = code.replace("spir_kernel ", "");
        self.run(level, ["-cc1", "-x", "ir", "-S"].map(str::to_owned).into_iter(), plain.as_bytes()).map(drop)
    }

    /// The output of clang for the level.
    fn run(&self, level: &Level, arguments: impl Iterator<Item = String>, input: &[u8]) -> Result<String, String> {
        let mut child = Command::new(&self.program)
            .args(arguments)
            .args(["-triple", level.triple, "-target-cpu", level.cpu, "-O0", "-o", "-", "-"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Clang reads all input before it writes anything. If it stops reading, its messages have the reason.
        drop(child.stdin.take().unwrap().write_all(input));
        let output = child.wait_with_output().unwrap();
        let [made, said] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
        if output.status.success() { Ok(made) } else { Err(said) }
    }

    /// Compiles a program unless it was compiled before. True if it had to be compiled.
    ///
    /// # Errors
    /// As [`Compiler::compile`].
    pub fn compile_once(&self, level: &Level, options: &str, text: &str) -> Result<bool, String> {
        let all = format!("{}\n{OPTIONS}\n{EXTENSIONS:?}\n{level:?}\n{options}\n{text}", self.version);
        let mark = self.kept.join(blake3::hash(all.as_bytes()).to_hex().as_str());
        if mark.exists() {
            return Ok(false);
        }
        self.compile(level, options, text)?;
        std::fs::write(mark, "").unwrap();
        Ok(true)
    }
}
