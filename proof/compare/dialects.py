"""Log files by the writers that people use: pandas, numpy, scipy, h5py, pyarrow, Excel by openpyxl.

Writes one log by each, trains on it, and compares estimates bit for bit with those of plain CSV. Files that host-sim
refuses are converted by the lines of Python that it prints, which are run as they stand.

    python compare/dialects.py [path of host-sim]
"""

import gzip
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
import pandas as pd

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = str(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/host-sim").resolve())
NAMES = ["a", "b", "f"]


def log():
    """Two readings and a force, with a missing value, and numbers of up to 17 digits."""
    random = np.random.default_rng(1)
    x = np.linspace(0, 1, 300)
    table = pd.DataFrame({"a": 1234.5 * x + random.normal(0, 1e-3, 300), "b": np.sin(5 * x), "f": 2 * x * x - 1})
    table.loc[7, "b"] = np.nan
    return table


def writers(table, folder):
    """Files that are read, each by its name and whether it names columns."""
    bare = table.to_numpy()
    stamped = table.assign(time=pd.date_range("2026-11-01 07:30", periods=len(table), freq="20ms"))
    labelled = table.assign(object=["pen", "cup", "ball"] * 100)

    def write(name, writer):
        writer(folder / name)
        return name

    german = {"sep": ";", "decimal": ","}
    with_units = pd.concat([pd.DataFrame([["V", "V", "N"]], columns=NAMES), table.astype(object)])
    yield write("index.csv", lambda path: table.to_csv(path)), True
    yield write("excel-german.csv", lambda path: table.to_csv(path, index=False, encoding="cp1252", lineterminator="\r\n", **german)), True
    yield write("german-index.csv", lambda path: table.to_csv(path, **german)), True
    yield write("decimal-alone.csv", lambda path: table.to_csv(path, index=False, decimal=",")), True
    yield write("quoted.csv", lambda path: table.to_csv(path, index=False, quoting=1)), True
    yield write("utf-16.csv", lambda path: table.to_csv(path, index=False, encoding="utf-16", sep="\t")), True
    yield write("bom.csv", lambda path: table.to_csv(path, index=False, encoding="utf-8-sig")), True
    yield write("tabs.tsv", lambda path: table.to_csv(path, index=False, sep="\t", na_rep="N/A")), True
    yield write("packed.csv.gz", lambda path: table.to_csv(path, index=False)), True
    yield write("packed-german.gz", lambda path: path.write_bytes(gzip.compress(table.to_csv(**german).encode("latin-1")))), True
    yield write("stamped.csv", lambda path: stamped.to_csv(path, index=False)), True
    yield write("labelled.csv", lambda path: labelled.to_csv(path, index=False)), True
    yield write("units.csv", lambda path: with_units.to_csv(path, index=False)), True
    yield write("units-german.csv", lambda path: with_units.to_csv(path, index=False, **german)), True
    yield write("excel-sep.csv", lambda path: path.write_text("sep=;\n" + table.to_csv(index=False, **german))), True
    yield write("savetxt.txt", lambda path: np.savetxt(path, bare, header="a b f")), True
    yield write("savetxt.csv", lambda path: np.savetxt(path, bare, delimiter=",", header="a,b,f")), True
    yield write("savetxt-named.csv", lambda path: np.savetxt(path, bare, delimiter=",", header="a,b,f", comments="")), True
    yield write("savetxt-remark.csv", lambda path: np.savetxt(path, bare, delimiter=",", header="a log\nof one press", comments="% ")), False
    yield write("savetxt-bare.txt", lambda path: np.savetxt(path, bare)), False
    yield write("savetxt-tabs.txt", lambda path: np.savetxt(path, bare, delimiter="\t")), False
    yield write("array.npy", lambda path: np.save(path, bare)), False
    yield write("arrays.npz", lambda path: np.savez(path, **{name: table[name].to_numpy() for name in NAMES})), True


def foreign(table, folder):
    """Files that are refused with lines of Python: name, and whether these give names to columns."""
    import h5py
    import scipy.io

    table.to_parquet(folder / "log.parquet")
    yield "log.parquet", True
    table.to_feather(folder / "log.feather")
    yield "log.feather", True
    table.to_pickle(folder / "log.pkl")
    yield "log.pkl", True
    table.to_excel(folder / "log.xlsx", index=False)
    yield "log.xlsx", True
    table.to_csv(folder / "log.zip", index=False)
    yield "log.zip", True
    table.to_csv(folder / "log.csv.xz", index=False)
    yield "log.csv.xz", True
    scipy.io.savemat(folder / "log.mat", {"NAME": table.to_numpy()})
    yield "log.mat", False
    with h5py.File(folder / "log.h5", "w") as file:
        file["NAME"] = table.to_numpy()
    yield "log.h5", False


def run(folder, *arguments):
    return subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True, text=True, check=False)


def estimates(folder, name, names_columns):
    """Bits of the estimates for a file, of a model that is trained on it, and what was said of the file."""
    inputs, output = ("a,b", "f") if names_columns else ("c1,c2", "c3")
    options = ["--inputs", inputs, "--outputs", output, "--no-refine", "--centres", "9", "-o", "m.bin"]
    trained = run(folder, "train", name, *options)
    if trained.returncode:
        raise SystemExit(f"{name}: {trained.stderr}")
    said = re.search(rf"note: {re.escape(name)}: (.*)", trained.stderr)
    decoded = run(folder, "decode", "m.bin", name, "-o", "e.csv")
    if decoded.returncode:
        raise SystemExit(f"{name}: {decoded.stderr}")
    column = np.loadtxt(folder / "e.csv", delimiter=",", skiprows=1, usecols=0, converters=lambda it: float(it or "nan"))
    return column.tobytes(), said.group(1) if said else ""


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        table = log()
        table.to_csv(folder / "plain.csv", index=False)
        expected, _ = estimates(folder, "plain.csv", True)
        differ = 0
        for name, names_columns in writers(table, folder):
            found, said = estimates(folder, name, names_columns)
            differ += found != expected
            print(f"{name:22} {'same' if found == expected else 'DIFFERS'}  {said}")
        for name, names_columns in foreign(table, folder):
            refused = run(folder, "train", name, "--inputs", "a", "--outputs", "f", "-o", "x.bin")
            python = "\n".join(line[4:] for line in refused.stderr.splitlines() if line.startswith("    "))
            subprocess.run([sys.executable, "-c", python], cwd=folder, check=True)
            converted = re.search(r"(?:to_csv|savetxt)\('([^']*)'", python).group(1)
            found, _ = estimates(folder, converted, names_columns)
            differ += found != expected
            print(f"{name:22} {'same' if found == expected else 'DIFFERS'}  by {python.splitlines()[-1]}")
        print(f"{differ} differ")
        return differ > 0


if __name__ == "__main__":
    sys.exit(main())
