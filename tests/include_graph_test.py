#!/usr/bin/env python3
"""Fails on an include against the order of the modules (docs/architecture.md), on an internal header that is included
from outside its module, on a using-directive in a header, and on CMake links that are missing or not used.

    include_graph_test.py PROJECT            checks
    include_graph_test.py PROJECT --draw     prints the graph of modules as Mermaid
    include_graph_test.py --self-test        shows that each rule can fail
"""
import re
import sys
import tempfile
from pathlib import Path

# What a module may include: the modules below it. `tests` stands for all code that only tests or measures the rest.
BASE = {"core", "numerics", "image_io", "storage"}
BELOW_STAGES = BASE | {"rig", "calibration_io", "camera", "imaging"}
STAGES = BELOW_STAGES | {"reconstruction", "odometry"}
SYSTEM = STAGES | {"slam", "localization"}
ALL = SYSTEM | {"eval", "calibration", "rig_design", "system", "report", "sim"}
MAY_INCLUDE = {
    "core": set(),
    "numerics": {"core"},
    "image_io": {"core"},
    "storage": {"core"},
    "rig": {"core"},
    "calibration_io": {"core", "image_io", "rig"},
    "rig_design": {"core", "rig"},
    "camera": BASE | {"rig", "calibration_io"},
    "imaging": BELOW_STAGES,
    "reconstruction": BELOW_STAGES,
    "figures": BELOW_STAGES | {"reconstruction"},
    "odometry": BELOW_STAGES,
    "calibration": BELOW_STAGES | {"odometry"},
    "slam": BELOW_STAGES | {"reconstruction"},
    "localization": BASE | {"rig", "calibration_io", "camera"},
    "eval": BASE,
    "sim": BASE | {"rig", "calibration_io", "camera"},
    "testing": BASE | {"rig", "calibration_io", "camera"},
    "system": SYSTEM | {"figures", "calibration"},
    "report": SYSTEM | {"figures", "calibration", "rig_design", "eval", "system"},
    "viewer": ALL | {"figures"},
    "program": ALL | {"viewer"},
    "python": ALL,
    "tests": ALL | {"figures", "testing"},
}
# Modules whose headers are not installed: no public header may include them.
PRIVATE_MODULES = {"numerics", "figures", "testing"}
# Components of a module that may not include each other freely: what each may include of its own module ("." is the
# module's own folder). Other modules have no such rule.
COMPONENTS = {
    "rig": {
        "models": {"internal"},
        ".": {"models", "internal"},
        "internal": {".", "models"},
    },
}
# Headers of third parties that stay out of public headers, except in headers named *_bridge.h.
HEAVY = re.compile(r"^(opencv2|ceres|sqlite3|yaml-cpp|embree3|gdal|octomap|nlohmann|spdlog|tbb|hwy|CLI)\b")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
USING = re.compile(r"^\s*using namespace\b", re.MULTILINE)
UNNAMED = re.compile(r"^\s*namespace\s*\{", re.MULTILINE)
MODULE_CALL = re.compile(r"^\s*spartan_module\(\s*(\w+)([^)]*)\)", re.MULTILINE)


def cpp_files(folder):
    return sorted(path for path in folder.rglob("*") if path.suffix in {".h", ".cpp"})


def module_of(path, project):
    """The module a file belongs to; tests of any module are `tests`, they may also use `testing`."""
    parts = path.relative_to(project).parts
    if parts[:2] == ("src", "spartan"):
        return parts[2]
    if parts[:2] == ("python", "bindings"):
        return "python"
    return parts[1] if parts[:2] in (("src", "program"), ("src", "viewer")) else "tests"


def component_of(parts):
    """The component within the module, of the parts of a path that starts with the module's folder."""
    return parts[1] if len(parts) > 2 else "."


def fault_of_components(path, included, project):
    """What is wrong with an include from one component of a module into another, or None."""
    parts, target = path.relative_to(project / "src/spartan").parts, included.split("/")[1:]
    if parts[0] not in COMPONENTS:
        return None
    components, own, other = COMPONENTS[parts[0]], component_of(parts), component_of(target)
    if own not in components:
        return f"{parts[0]}/{own} is not listed in COMPONENTS of include_graph_test.py"
    if other != own and other not in components[own]:
        return f"{parts[0]}/{own} includes {included}, which is not below it"
    return None


def namespace_faults(project):
    """Headers with a using-directive, which opens a namespace for all includers, or an unnamed namespace, whose types
    differ from file to file (GCC warns of that with -Wsubobject-linkage, but not in unity builds)."""
    for folder in ("src", "python", "tests", "bench"):
        for path in sorted((project / folder).rglob("*.h")):
            if USING.search(path.read_text(encoding="utf-8")):
                yield f"{path.relative_to(project)}: a using-directive in a header"
            if UNNAMED.search(path.read_text(encoding="utf-8")):
                yield f"{path.relative_to(project)}: an unnamed namespace in a header"


def is_internal(included):
    return "/internal/" in included


def includes(project):
    """Every include as (file, line number, quote, included path)."""
    for folder in ("src", "python", "tests", "bench"):
        for path in cpp_files(project / folder):
            text = path.read_text(encoding="utf-8")
            for match in INCLUDE.finditer(text):
                yield path, text.count("\n", 0, match.start(2)) + 1, match[1], match[2]


def declared_uses(project):
    """USES of every spartan_module() in the top CMakeLists.txt, and what follows from them (links are public)."""
    text = re.sub(r"#.*", "", (project / "CMakeLists.txt").read_text(encoding="utf-8"))
    direct = {}
    for name, arguments in MODULE_CALL.findall(text):
        words = arguments.split()
        used = words[words.index("USES") + 1:] if "USES" in words else []
        end = next((i for i, word in enumerate(used) if word.isupper()), len(used))
        direct[name] = set(used[:end])
    closed = {}
    for name in direct:
        reached, todo = set(), list(direct[name])
        while todo:
            module = todo.pop()
            if module not in reached:
                reached.add(module)
                todo.extend(direct.get(module, ()))
        closed[name] = reached
    return direct, closed


def faults(project):
    found = []
    direct, linked = declared_uses(project)
    if not direct:
        found.append("CMakeLists.txt: no spartan_module() found")
    for name, used in sorted(direct.items()):
        if name not in MAY_INCLUDE:
            found.append(f"CMakeLists.txt: module {name} is not listed in MAY_INCLUDE of include_graph_test.py")
        elif not linked[name] <= MAY_INCLUDE[name]:
            found.append(f"CMakeLists.txt: {name} links {sorted(linked[name] - MAY_INCLUDE[name])}, which it may not include")

    found.extend(namespace_faults(project))
    count, used_by = 0, {}
    for path, line, quote, included in includes(project):
        where = f"{path.relative_to(project)}:{line}"
        module = module_of(path, project)
        is_test = path.stem.endswith("_test")
        public = (path.suffix == ".h" and not is_test and not is_internal(str(path)) and
                  module not in {"program", "viewer", "python", "tests"} | PRIVATE_MODULES)
        parts = included.split("/")
        if parts[0] == "spartan" and len(parts) > 2:
            count += 1
            target = parts[1]
            if not is_test:
                used_by.setdefault(module, set()).add(target)
            allowed = MAY_INCLUDE.get(module, set()) | {module} | (PRIVATE_MODULES if is_test else set())
            if not (project / "src" / included).is_file():
                found.append(f"{where}: {included} does not exist")
            elif target not in allowed:
                found.append(f"{where}: {module} includes {included}, which is not below it")
            elif is_internal(included) and target != module and not is_test and module != "tests":
                found.append(f"{where}: {included} is internal to {target}")
            elif public and (is_internal(included) or target in PRIVATE_MODULES):
                found.append(f"{where}: a public header includes {included}, which is not installed")
            elif target == module and not is_test and (fault := fault_of_components(path, included, project)):
                found.append(f"{where}: {fault}")
            elif module in linked and not is_test and target not in linked[module] | {module}:
                found.append(f"{where}: {module} includes {included}, but CMakeLists.txt does not list {target} in its USES")
        elif quote == '"' and path.relative_to(project).parts[:2] == ("src", "spartan"):
            found.append(f'{where}: "{included}": write the whole path, "spartan/<module>/…"')
        if public and HEAVY.match(included) and not path.stem.endswith("_bridge"):
            found.append(f"{where}: <{included}> in a public header; only headers named *_bridge.h may")
    for name, listed in sorted(direct.items()):
        for unused in sorted(listed - used_by.get(name, set())):
            found.append(f"CMakeLists.txt: {name} lists {unused} in its USES, but includes nothing of it")
    if count == 0:
        found.append("no includes found: is this the project's folder?")
    return found


def draw(project):
    arrows = set()
    for path, _, _, included in includes(project):
        parts, module = included.split("/"), module_of(path, project)
        if parts[0] == "spartan" and not path.stem.endswith("_test") and module not in {"tests", parts[1]}:
            arrows.add((module, parts[1]))
    return "\n".join(["graph TD"] + [f"  {a} --> {b}" for a, b in sorted(arrows)])


def self_test():
    """Each file below breaks one rule; the checker must name it, and nothing else."""
    good_cmake = ("spartan_module(core)\nspartan_module(numerics)\nspartan_module(rig USES core PRIVATE fmt)\n"
                  "spartan_module(eval USES core numerics)\n")
    cases = [
        ("src/spartan/core/up.h", '#include "spartan/rig/rig.h"', "is not below it"),
        ("src/spartan/eval/sideways.cpp", '#include "spartan/rig/rig.h"', "is not below it"),
        ("src/spartan/rig/test_code.cpp", '#include "spartan/testing/laws.h"', "is not below it"),
        ("src/program/command.cpp", '#include "spartan/testing/laws.h"', "is not below it"),
        ("src/spartan/rig/gone.cpp", '#include "spartan/core/gone.h"', "does not exist"),
        ("src/spartan/rig/short.cpp", '#include "rig.h"', "whole path"),
        ("src/spartan/rig/heavy.h", "#include <opencv2/core.hpp>", "public header"),
        ("src/spartan/rig/models/up.cpp", '#include "spartan/rig/rig.h"', "is not below it"),
        ("src/spartan/rig/attic/new.cpp", '#include "spartan/rig/rig.h"', "not listed in COMPONENTS"),
        ("src/spartan/eval/inside.cpp", '#include "spartan/core/internal/detail.h"', "is internal to core"),
        ("src/program/inside.cpp", '#include "spartan/core/internal/detail.h"', "is internal to core"),
        ("python/bindings/inside.cpp", '#include "spartan/core/internal/detail.h"', "is internal to core"),
        ("src/spartan/core/leak.h", '#include "spartan/core/internal/detail.h"', "which is not installed"),
        ("src/spartan/eval/open.h", "using namespace std;", "using-directive in a header"),
        ("src/spartan/eval/open.cpp", "using namespace std;", None),
        ("src/spartan/eval/hidden.h", "namespace {", "an unnamed namespace in a header"),
        ("src/spartan/eval/hidden.cpp", "namespace {", None),
        ("src/spartan/eval/leak.h", '#include "spartan/numerics/median.h"', "which is not installed"),
        ("CMakeLists.txt", good_cmake + "spartan_module(camera USES core eval)", "may not include|includes nothing of it"),
        ("CMakeLists.txt", good_cmake + "spartan_module(imaging USES core)", "includes nothing of it"),
        ("CMakeLists.txt", "spartan_module(core)\nspartan_module(rig PRIVATE core)\nspartan_module(eval USES core)\n",
         "in its USES"),
        ("src/spartan/rig/rig_test.cpp", '#include "spartan/testing/laws.h"', None),
        ("src/spartan/rig/models/up_test.cpp", '#include "spartan/rig/rig.h"', None),
        ("src/spartan/core/use.cpp", '#include "spartan/core/internal/detail.h"', None),
        ("src/spartan/core/internal/heavy.h", "#include <opencv2/core.hpp>", None),
        ("src/spartan/rig/rig_test.cpp", '#include "spartan/core/internal/detail.h"', None),
        ("src/spartan/core/opencv_bridge.h", "#include <opencv2/core.hpp>", None),
        ("bench/tool.cpp", '#include "spartan/core/internal/detail.h"', None),
        ("tools/tool.cpp", '#include "spartan/testing/laws.h"', None),
    ]
    for name, content, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            project = Path(folder)
            files = {"CMakeLists.txt": good_cmake, "src/spartan/core/pose.h": "", "src/spartan/testing/laws.h": "",
                     "src/spartan/core/internal/detail.h": "", "src/spartan/numerics/median.h": "",
                     "src/spartan/eval/use.cpp": '#include "spartan/numerics/median.h"',
                     "src/spartan/eval/metrics.h": '#include "spartan/core/pose.h"',
                     "src/spartan/rig/rig.h": '#include "spartan/core/pose.h"', name: content}
            for path, text in files.items():
                (project / path).parent.mkdir(parents=True, exist_ok=True)
                (project / path).write_text(text, encoding="utf-8")
            found = faults(project)
            if (not found) != (expected is None) or any(not re.search(expected, fault) for fault in found):
                return f"{name} with {content!r}: expected {expected!r}, found {found}"
    return None


def main(arguments):
    if arguments == ["--self-test"]:
        problem = self_test()
        print(problem or "every rule fails where it should")
        return 1 if problem else 0
    project = Path(arguments[0]).resolve()
    if "--draw" in arguments:
        print(draw(project))
        return 0
    found = faults(project)
    print("\n".join(found) or "the include graph is as it should be")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
