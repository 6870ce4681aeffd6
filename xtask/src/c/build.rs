//! Ways to compile a model and the harness, and to run both.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::emulate::qemu::{QEMU, reader, wait};
use crate::process::{Outcome, root};

/// Compiler for a Cortex-M.
pub const ARM: &str = "arm-none-eabi-gcc";

/// File of frames in a model's folder.
pub const FRAMES: &str = "frames.bin";

/// Flags that make a compiler say all that it finds doubtful, and refuse it.
const SILENT: [&str; 5] = ["-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"];

/// Flags for a Cortex-M4F without a C library. Builtin functions are allowed nevertheless: a copy of a word is a move.
const CORTEX_M4F: [&str; 7] = [
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfpu=fpv4-sp-d16",
    "-mfloat-abi=hard",
    "-ffreestanding",
    "-fbuiltin",
    "-ffunction-sections",
];

/// Time limit of a run.
const LIMIT: Duration = Duration::from_mins(10);

/// Who calls the model's code, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Caller {
    /// The same compiler's C, on this machine.
    Host,
    /// C++, on this machine.
    CPlusPlus,
    /// The same compiler's C, in QEMU.
    Emulator,
}

/// One way to compile.
#[derive(Debug, Clone, Copy)]
pub struct Build {
    compiler: &'static str,
    flags: &'static [&'static str],
    caller: Caller,
    /// Whether the pragma against fused operations is taken out, to show what it is for.
    without_pragma: bool,
}

impl Build {
    const fn new(compiler: &'static str, flags: &'static [&'static str], caller: Caller) -> Self {
        Self { compiler, flags, caller, without_pragma: false }
    }

    /// All ways, or those that CI tries.
    pub fn all(short: bool) -> Vec<Self> {
        use Caller::{CPlusPlus, Emulator, Host};
        const FAST: &[&str] = &["-std=gnu17", "-O2", "-ffp-contract=fast"];
        let usual = [
            Self::new("gcc", &["-std=gnu17", "-O3", "-march=native"], Host),
            Self::new("clang", &["-std=c99", "-O2"], Host),
            Self::new("g++", &["-std=c++11", "-O2"], CPlusPlus),
            Self::new(ARM, FAST, Emulator),
        ];
        if short {
            return usual.into();
        }
        let host = ["gcc", "clang"].into_iter().flat_map(|compiler| {
            let flags: [&[&str]; 6] = [
                &["-std=c99", "-O0"],
                &["-std=c99", "-O2"],
                &["-std=c99", "-O3", "-march=native"],
                &["-std=gnu17", "-O0"],
                &["-std=gnu17", "-O2"],
                &["-std=gnu17", "-O3", "-march=native"],
            ];
            flags.map(|flags| Self::new(compiler, flags, Host))
        });
        let others = [
            Self::new("gcc", FAST, Host),
            Self::new("gcc", &["-std=gnu17", "-O3", "-march=native", "-ffp-contract=fast"], Host),
            Self::new("g++", &["-std=c++11", "-O2"], CPlusPlus),
            Self::new(ARM, &["-std=c99", "-O2"], Emulator),
            Self::new(ARM, &["-std=gnu17", "-Os"], Emulator),
            Self::new(ARM, FAST, Emulator),
            Self { without_pragma: true, ..Self::new(ARM, FAST, Emulator) },
        ];
        host.chain(others).collect()
    }

    /// Name for tables.
    pub fn name(&self) -> String {
        let without = if self.without_pragma { ", without its pragma" } else { "" };
        let caller = if self.caller == Caller::CPlusPlus { " calls gcc" } else { "" };
        format!("{}{caller} {}{without}", self.compiler, self.flags.join(" "))
    }

    /// Programs that it takes.
    pub fn needs(&self) -> &'static [&'static str] {
        match self.caller {
            Caller::Host if self.compiler == "clang" => &["clang"],
            Caller::Host => &["gcc"],
            Caller::CPlusPlus => &["g++", "gcc"],
            Caller::Emulator => &[ARM, QEMU],
        }
    }

    /// Whether it takes something away that bits depend on, where operations can be fused.
    pub fn is_spoilt(&self) -> bool {
        self.without_pragma
    }

    /// Compiles the model in `folder`, and runs it on the frames there. The error begins with the frame that differs.
    pub fn compare(&self, folder: &Path) -> Outcome {
        let program = self.program(folder)?;
        let frames = folder.join(FRAMES);
        match self.caller {
            Caller::Host | Caller::CPlusPlus => said(Command::new(&program).arg(frames)).map(drop),
            Caller::Emulator => {
                let mut command = machine(&program, &frames);
                let mut child = command.spawn().map_err(|cause| format!("{QEMU}: {cause}"))?;
                let (out, err) = (reader(child.stdout.take()), reader(child.stderr.take()));
                let status = wait(&mut child, LIMIT)?;
                let text = [out, err].map(|it| it.join().unwrap_or_default()).concat();
                match status {
                    Some(status) if status.success() => Ok(()),
                    Some(_) => Err(String::from_utf8_lossy(&text).trim().to_owned()),
                    None => Err(format!("no end within {} s", LIMIT.as_secs())),
                }
            }
        }
    }

    /// Compiles and links the model in `folder` with the harness. Returns the program's path.
    pub fn program(&self, folder: &Path) -> Outcome<PathBuf> {
        let own: String =
            self.name().chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        let place = folder.join(own);
        fs::create_dir_all(&place).map_err(|cause| format!("{}: {cause}", place.display()))?;
        let (harness, sources) = (root().join("xtask/src/c/harness"), folder.join("src"));
        let mut source = sources.join("model.c");
        if self.without_pragma {
            let failed = |cause| format!("{}: {cause}", source.display());
            let text = fs::read_to_string(&source).map_err(failed)?;
            let spoilt = text.replace("#pragma GCC optimize", "// #pragma GCC optimize");
            let path = place.join("model.c");
            fs::write(&path, spoilt).map_err(|cause| format!("{}: {cause}", path.display()))?;
            source = path;
        }
        let compile = |compiler: &str, flags: &[&str], source: &Path, object: &str| {
            let object = place.join(object);
            let mut command = Command::new(compiler);
            command.args(flags).args(SILENT).arg("-c").arg(source).arg("-o").arg(&object);
            command.arg("-I").arg(&sources).arg("-I").arg(&harness);
            if self.caller == Caller::Emulator {
                command.args(CORTEX_M4F).arg("-I").arg(harness.join("arm"));
            }
            said(&mut command).map(|_| object)
        };
        let main = harness.join("main.c");
        let program = place.join("program");
        let mut link = Command::new(self.compiler);
        match self.caller {
            Caller::Host => {
                link.arg(compile(self.compiler, self.flags, &source, "model.o")?);
                link.arg(compile(self.compiler, self.flags, &main, "main.o")?);
                link.arg(compile(self.compiler, self.flags, &harness.join("host.c"), "host.o")?);
                // The example is compiled as well.
                let example = folder.join("examples/posix/main.c");
                compile(self.compiler, self.flags, &example, "example.o")?;
            }
            Caller::CPlusPlus => {
                const C: &[&str] = &["-std=c99", "-O2"];
                link.arg(compile("gcc", C, &source, "model.o")?);
                link.arg(compile("gcc", C, &harness.join("host.c"), "host.o")?);
                let flags = [self.flags, &["-x", "c++"]].concat();
                link.arg(compile(self.compiler, &flags, &main, "main.o")?);
                // The Arduino IDE includes its own header in a sketch.
                let board = harness.join("arduino/Arduino.h").display().to_string();
                let flags = [&flags[..], &["-include", &board]].concat();
                let sketch = folder.join("examples/Decode/Decode.ino");
                compile(self.compiler, &flags, &sketch, "sketch.o")?;
            }
            Caller::Emulator => {
                let platform = harness.join("arm/cortex-m4.c");
                link.arg(compile(self.compiler, self.flags, &source, "model.o")?);
                link.arg(compile(self.compiler, self.flags, &main, "main.o")?);
                // Its own loops that copy must not become calls of themselves.
                let flags = ["-std=gnu17", "-O2", "-fno-tree-loop-distribute-patterns"];
                link.arg(compile(self.compiler, &flags, &platform, "platform.o")?);
                link.args(CORTEX_M4F).args(["-nostdlib", "-T"]).arg(harness.join("arm/link.ld"));
                link.args(["-Wl,--gc-sections", "-lgcc"]);
            }
        }
        said(link.arg("-o").arg(&program)).map(|_| program)
    }
}

/// Compiles the model in `folder` for a Cortex-M0+, which has no float unit. Returns the object's path.
pub fn object_for_m0_plus(folder: &Path) -> Outcome<PathBuf> {
    let object = folder.join("m0-plus.o");
    let mut command = Command::new(ARM);
    command
        .args(["-std=c99", "-O2", "-mcpu=cortex-m0plus", "-mthumb", "-ffreestanding"])
        .args(SILENT);
    command.arg("-c").arg(folder.join("src/model.c")).arg("-o").arg(&object);
    said(command.arg("-I").arg(root().join("xtask/src/c/harness/arm"))).map(|_| object)
}

/// Command that runs `program` in QEMU on the file of `frames`.
pub fn machine(program: &Path, frames: &Path) -> Command {
    let mut command = Command::new(QEMU);
    command.args(["-M", "mps2-an386", "-cpu", "cortex-m4", "-display", "none", "-monitor", "none"]);
    // QEMU reads a comma as the end of an option unless it is doubled.
    let path = frames.display().to_string().replace(',', ",,");
    command.args(["-semihosting-config", &format!("enable=on,target=native,arg={path}")]);
    command.args(["-serial", "none"]).arg("-kernel").arg(program);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs `command`; the error is what it says.
fn said(command: &mut Command) -> Outcome<String> {
    let output = command
        .output()
        .map_err(|cause| format!("{}: {cause}", command.get_program().display()))?;
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8_lossy(&text).trim().to_owned();
    if output.status.success() && text.is_empty() {
        Ok(text)
    } else if text.is_empty() {
        Err(format!("{} ended with {}", command.get_program().display(), output.status))
    } else {
        Err(text)
    }
}
