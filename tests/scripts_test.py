#!/usr/bin/env python3
"""Tests of scripts/coverage_by_module, scripts/mutation and scripts/site_hooks.py: what they count, which mutants they make, and
which links they find to be broken."""
import importlib.util
import subprocess
import sys
import tempfile
import types
import unittest
import unittest.mock
from importlib.machinery import SourceFileLoader
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
sys.dont_write_bytecode = True


def loaded(name):
    loader = SourceFileLoader(name, str(SCRIPTS / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


class SiteLinks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        names = ("mkdocs", "mkdocs.exceptions", "mkdocs.structure", "mkdocs.structure.files")
        modules = {name: types.ModuleType(name) for name in names}  # MkDocs need not be installed
        modules["mkdocs.exceptions"].PluginError = ValueError
        modules["mkdocs.structure.files"].File = None
        with unittest.mock.patch.dict(sys.modules, modules):
            cls.hooks = loaded("site_hooks.py")

    def on_page(self, text):
        return self.hooks.rewritten(text, "docs/tutorials/rover.md", "tutorials/rover.md")

    def test_links_lead_to_where_files_are_on_the_site(self):
        self.assertEqual(self.on_page("[a](../limits.md#x) [b](../../README.md)"), "[a](../limits.md#x) [b](../index.md)")
        self.assertEqual(self.on_page("[c](../../tests/consumer/main.cpp)"), "[c](../tests/consumer/main.cpp)")
        self.assertEqual(self.on_page("[folder](../../tests/consumer), [notebook](kitti.ipynb)"), "folder, notebook")

    def test_a_link_that_leads_to_nothing_is_an_error(self):
        for link in ("[a](../../tests/consumer/none.cpp)", "[b](none.md)", "[c](../../none)", "[d](../../../main)"):
            with self.assertRaisesRegex(ValueError, "rover.md: the link to"):
                self.on_page(link)


class CoverageByModule(unittest.TestCase):
    def branches(self, source, *branches):
        """Counts of the branches of a line; (count, "fall", "throw" or "")."""
        line = {"branches": [{"count": count, "fallthrough": kind == "fall", "throw": kind == "throw"}
                             for count, kind in branches]}
        return loaded("coverage_by_module").branches_of(line, source)

    def test_branches_of_calls_are_not_counted(self):
        call = ((7, "fall"), (0, "throw"))
        self.assertEqual(self.branches("  if (f(x)) g(x);", *call, (3, "fall"), (4, ""), *call), [3, 4])
        self.assertEqual(self.branches("  if (f(x)) g(x);", (0, "throw"), (7, "fall"), (3, ""), (4, "")), [3, 4])

    def test_a_line_has_the_branches_that_it_states(self):
        pairs = ((1, "fall"), (2, ""), (3, "fall"), (4, ""), (0, ""), (0, ""))
        self.assertEqual(self.branches("  return failure(x);  // if and ?", *pairs), [])
        self.assertEqual(self.branches('  if (x) return failure("a && b");', *pairs), [1, 2])
        self.assertEqual(self.branches("  const int y = a && b ? 1 : 2;", *pairs), [1, 2, 3, 4])
        self.assertEqual(self.branches("  A& operator=(A&& other) {", *pairs), [])
        self.assertEqual(self.branches("  switch (x) {", *pairs), [1, 2, 3, 4, 0, 0])

    def test_adds_the_files_of_a_module(self):
        line = {"gcovr/noncode": False, "gcovr/excluded": False}
        branches = [{"count": 5, "fallthrough": True, "throw": False},
                    {"count": 0, "fallthrough": False, "throw": False}]
        lines = [{**line, "line_number": 1, "count": 5, "branches": branches},
                 {**line, "line_number": 2, "count": 0, "branches": []},
                 {**line, "line_number": 3, "count": 0, "branches": [], "gcovr/noncode": True}]
        names = ("src/spartan/core/a.cpp", "src/spartan/core/internal/b.h", "src/program/main.cpp")
        with tempfile.TemporaryDirectory() as folder:
            for name in names:
                (Path(folder) / name).parent.mkdir(parents=True, exist_ok=True)
                (Path(folder) / name).write_text("  if (x)\n  y = 1;\n}\n", encoding="utf-8")
            report = {"files": [{"file": name, "lines": lines} for name in names]}
            counts = loaded("coverage_by_module").counts_of(report, Path(folder))
        self.assertEqual(counts, {"core": {"line": [2, 4], "branch": [2, 4]},
                                  "program": {"line": [1, 2], "branch": [1, 2]}})

    def test_each_minimum_of_each_required_module(self):
        script = loaded("coverage_by_module")
        good = {module: {"line": [95, 100], "branch": [85, 100]} for module in script.REQUIRED}
        self.assertEqual(list(script.shortfalls({**good, "program": {"line": [0, 9], "branch": [0, 9]}})), [])
        bad = {**good, "slam": {"line": [94, 100], "branch": [84, 100]}}
        del bad["rig"]
        self.assertEqual(list(script.shortfalls(bad)), [
            "rig: not in the report", "slam: line coverage 94.0 %, required 95 %",
            "slam: branch coverage 84.0 %, required 85 %"])


class Mutation(unittest.TestCase):
    def mutants(self, text):
        """(line, what, mutated line) of every mutant of a file with this text."""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "a.cpp"
            file.write_text(text, encoding="utf-8")
            return [(mutant.line, mutant.what, mutant.after) for mutant in loaded("mutation").mutants_of(file)]

    def test_operators(self):
        self.assertEqual(self.mutants("  return a + b * c <= d;\n"), [
            (1, "+ to -", "  return a - b * c <= d;"), (1, "* to /", "  return a + b / c <= d;"),
            (1, "<= to <", "  return a + b * c < d;")])

    def test_constants_that_are_zero_or_one(self):
        self.assertEqual(self.mutants("  return f(1.0, 10, x0, 0, 1e3, '1', 2.0);\n"), [
            (1, "1.0 to 0.0", "  return f(0.0, 10, x0, 0, 1e3, '1', 2.0);"),
            (1, "0 to 1", "  return f(1.0, 10, x0, 1, 1e3, '1', 2.0);")])

    def test_conditions_and_statements(self):
        self.assertEqual(self.mutants("  if (ready(a)) continue;\n"), [(1, "negate", "  if (!(ready(a))) continue;")])
        self.assertEqual(self.mutants("  x.y[k] = z;\n"), [(1, "drop", "  ;")])
        self.assertEqual(self.mutants("  list.push_back(z);\n"), [(1, "drop", "  ;")])
        self.assertEqual(self.mutants("  const double x =\n      y(z);\n"), [])  # half of a statement
        self.assertEqual(self.mutants("  double x = y;\n  const auto z = f(x);\n  return x;\n"), [])

    def test_nothing_in_comments_strings_and_checks(self):
        self.assertEqual(self.mutants('// a + b\n  /* a + b\n 1 < 2 */\n  return "a + b";  // 1 == 0\n'
                                      '  assert(a < b);\n  throw E(a + b);\n#define A 1 + 1\n'), [])

    def test_a_selection_is_made_by_its_seed(self):
        def listed(*arguments):
            command = [SCRIPTS / "mutation", "--list", *arguments]
            return subprocess.run(command, capture_output=True, text=True, check=True).stdout
        self.assertEqual(listed("--seed", "3"), listed("--seed", "3"))
        self.assertNotEqual(listed("--seed", "3"), listed("--seed", "4"))
        self.assertNotIn("_test.", listed("--count", "100000"))


if __name__ == "__main__":
    unittest.main()
