"""Flash of a model as C: Taxel's export beside emlearn's and m2cgen's output, at about the same error.

    target/compare-venv/bin/pip install emlearn==0.23.2 m2cgen==0.10.0 scikit-learn==1.9.1
    cargo build --release
    target/compare-venv/bin/python proof/compare/c.py

The task is one output of the scene `press` from the 18 readings of its row: how far one electrode is pressed in. Each
library's model grows until its error on unseen frames is at most 5 % above that of Taxel's model with 16 centres. Code
and constants are those that arm-none-eabi-gcc makes for a Cortex-M4F. What they call besides is named and not counted.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile

import emlearn
import m2cgen
import numpy as np
from sklearn.ensemble import RandomForestRegressor
from sklearn.neural_network import MLPRegressor
from sklearn.preprocessing import StandardScaler

ROOT = pathlib.Path(__file__).resolve().parents[2]
OUTPUT, INPUTS = "r4e3_dz_mm", [f"r4c{k}_ohm" for k in range(1, 19)]
CORE = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-ffreestanding", "-fbuiltin"]
# Declarations that a compiler without a C library lacks.
HEADERS = {
    "math.h": "#define INFINITY __builtin_inff()\n#define NAN __builtin_nanf(\"\")\nfloat expf(float); double exp(double); float fabsf(float); float tanhf(float); float sqrtf(float);"
    " float logf(float); float powf(float, float); float roundf(float); double pow(double, double); float floorf(float);\n",
    "stdio.h": "int printf(const char *, ...); int snprintf(char *, unsigned, const char *, ...);\n",
    "stdlib.h": "#include <stddef.h>\nvoid *malloc(size_t); void free(void *); int abs(int);\n",
    "assert.h": "#define assert(x)\n",
}


def host_sim(*arguments: str) -> None:
    built = [path for kind in ("release", "debug") if (path := ROOT / "target" / kind / "host-sim").exists()]
    program = max(built, key=lambda path: path.stat().st_mtime)
    subprocess.run([program, *map(str, arguments), "--quiet"], check=True, stdout=subprocess.DEVNULL)


def columns(path: pathlib.Path, names: list[str]) -> np.ndarray:
    with open(path) as file:
        return np.array([[float(line[name]) for name in names] for line in csv.DictReader(file)], "f4")


def flash(folder: pathlib.Path, source: pathlib.Path, include: list) -> tuple[int, str]:
    """Bytes of code and constants of a C file, and what it calls."""
    stubs = folder / "stubs"
    stubs.mkdir(exist_ok=True)
    for name, text in HEADERS.items():
        (stubs / name).write_text(text)
    paths = [stubs, ROOT / "xtask/src/c/harness/arm", *include]
    compiled = source.with_suffix(".o")
    subprocess.run(
        ["arm-none-eabi-gcc", *CORE, "-Os", "-ffunction-sections", "-fdata-sections", "-w", "-c", source, "-o", compiled]
        + [f"-I{path}" for path in paths],
        check=True,
    )
    symbols = subprocess.run(["arm-none-eabi-nm", "-S", compiled], check=True, capture_output=True, text=True).stdout
    size, calls = 0, []
    for fields in map(str.split, symbols.splitlines()):
        if len(fields) == 4 and fields[2] in "tTrRdD" and "test" not in fields[3]:
            size += int(fields[1], 16)
        elif fields[0] == "U":
            calls.append(fields[1])
    return size, " ".join(calls)


def taxel(folder: pathlib.Path, number_format: str) -> np.ndarray:
    blob, estimate = folder / "model.bin", folder / "estimate.csv"
    host_sim("train", folder / "train.csv", "--inputs", ",".join(INPUTS), "--outputs", OUTPUT, "--centres", "16",
             "--format", number_format, "-o", blob)
    host_sim("decode", blob, folder / "test.csv", "-o", estimate)
    host_sim("export", blob, "--c", folder / "c", "--name", "press")
    return columns(estimate, [OUTPUT])[:, 0]


def main() -> None:
    folder = pathlib.Path(tempfile.mkdtemp())
    for name, frames, seed in (("train", 2000, 1), ("test", 2000, 2)):
        host_sim("synth", "press", "-n", str(frames), "--noise", "0.01", "--seed", str(seed), "-o", folder / f"{name}.csv")
    x, y = columns(folder / "train.csv", INPUTS), columns(folder / "train.csv", [OUTPUT])[:, 0]
    x_test, y_test = columns(folder / "test.csv", INPUTS), columns(folder / "test.csv", [OUTPUT])[:, 0]
    error = lambda estimate: float(np.sqrt(np.mean((estimate - y_test) ** 2)))
    print("| model | RMSE (mm) | code and constants (bytes) | calls |\n|---|--:|--:|---|")
    errors = []

    def show(name: str, rmse: float, source: pathlib.Path, include: list) -> None:
        size, calls = flash(folder, source, include)
        errors.append(rmse)
        print(f"| {name} | {rmse:.4f} | {size} | {calls} |", flush=True)

    for number_format in ("fixed16", "f32"):
        rmse = error(taxel(folder, number_format))
        show(f"Taxel, K = 16, {number_format}", rmse, folder / "c/src/press.c", [folder / "c/src"])
    most = 1.05 * errors[0]

    scaled = StandardScaler().fit(x)
    z, z_test = scaled.transform(x), scaled.transform(x_test)

    def grow(name, models, convert, include=()):
        """The first model whose error is small enough, or the one with the least error."""
        best = None
        for detail, model in models:
            model.fit(z, y)
            rmse = error(model.predict(z_test))
            if best is None or rmse < best[1]:
                best = (detail, rmse, model)
            if rmse <= most:
                break
        source = folder / "other.c"
        source.write_text(convert(best[2]))
        show(f"{name}, {best[0]}", best[1], source, list(include))

    def by_emlearn(**options):
        def convert(model):
            emlearn.convert(model, **options).save(name="em", file=str(folder / "em.h"))
            return '#include <stdint.h>\n' + (folder / "em.h").read_text()

        return convert

    include = [pathlib.Path(emlearn.__file__).parent / "../emlearn", pathlib.Path(emlearn.includedir)]
    networks = [(f"{n} hidden units", MLPRegressor(hidden_layer_sizes=(n,), max_iter=1000, random_state=1)) for n in (8, 16, 32, 64)]
    try:
        grow("emlearn, MLPRegressor", networks, by_emlearn(), include)
    except Exception as cause:
        print(f"emlearn does not convert MLPRegressor: {cause}", file=sys.stderr)
    forests = [
        (f"{n} trees of depth {d}", RandomForestRegressor(n_estimators=n, max_depth=d, random_state=1))
        for n, d in ((10, 6), (10, 8))
    ]
    grow("emlearn, RandomForestRegressor", forests, by_emlearn(method="inline", dtype="float"), include)
    # Its support vector machines are expressions too deep for Python from some hundred vectors on.
    grow("m2cgen, RandomForestRegressor", forests, m2cgen.export_to_c)



if __name__ == "__main__":
    main()
