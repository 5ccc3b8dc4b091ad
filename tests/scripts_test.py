#!/usr/bin/env python3
"""Tests of scripts/coverage_by_module and scripts/mutation: what they count, and which mutants they make."""
import importlib.util
import json
import subprocess
import sys
import tempfile
import unittest
from importlib.machinery import SourceFileLoader
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
sys.dont_write_bytecode = True


def loaded(name):
    loader = SourceFileLoader(name, str(SCRIPTS / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module


class CoverageByModule(unittest.TestCase):
    def run_on(self, without="", **changed):
        """Every required module with 96 of 100 lines and 86 of 100 branches in two files, but for `changed`."""
        files = []
        for module in loaded("coverage_by_module").REQUIRED:
            if module == without:
                continue
            lines, branches = changed.get(module, (96, 86))
            files += [{"filename": f"src/spartan/{module}/internal/a.cpp", "line_covered": lines - 40, "line_total": 60,
                       "branch_covered": 0, "branch_total": 0},
                      {"filename": f"src/spartan/{module}/b.h", "line_covered": 40, "line_total": 40,
                       "branch_covered": branches, "branch_total": 100}]
        files += [{"filename": "src/program/main.cpp", "line_covered": 1, "line_total": 10, "branch_covered": 0,
                   "branch_total": 10}]
        with tempfile.NamedTemporaryFile("w", suffix=".json") as summary:
            json.dump({"files": files}, summary)
            summary.flush()
            return subprocess.run([SCRIPTS / "coverage_by_module", summary.name], capture_output=True, text=True)

    def test_adds_the_files_of_a_module(self):
        done = self.run_on()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"\ncore +100 +96\.0 % +100 +86\.0 %")
        self.assertRegex(done.stdout, r"\nprogram +10 +10\.0 % +10 +0\.0 %")  # has no minimum

    def test_fails_below_each_minimum(self):
        for module, counts, text in (("slam", (94, 86), "slam: line coverage 94.0 %, required 95 %"),
                                     ("rig", (95, 84), "rig: branch coverage 84.0 %, required 85 %")):
            done = self.run_on(**{module: counts})
            self.assertEqual(done.returncode, 1)
            self.assertEqual(done.stderr.strip(), f"coverage_by_module: {text}")

    def test_fails_where_a_module_is_missing(self):
        done = self.run_on(without="camera")
        self.assertEqual(done.returncode, 1)
        self.assertIn("camera: not in the summary", done.stderr)


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
            return subprocess.run([SCRIPTS / "mutation", "--list", *arguments], capture_output=True, text=True, check=True)
        self.assertEqual(listed("--seed", "3").stdout, listed("--seed", "3").stdout)
        self.assertNotEqual(listed("--seed", "3").stdout, listed("--seed", "4").stdout)
        self.assertNotIn("_test.", listed("--count", "100000").stdout)


if __name__ == "__main__":
    unittest.main()
