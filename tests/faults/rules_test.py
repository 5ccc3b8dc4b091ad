#!/usr/bin/env python3
"""Tests of the fault injectors: a model that loses nothing, or a check that never fails, would hide faults."""
import random
import sqlite3
import tempfile
import unittest
from pathlib import Path

import lab
import mutate_inputs
import mutations
import power_loss
import run_faults
from power_loss import CREATE, MKDIR, RENAME, SYNC, SYNC_FOLDER, TRUNCATE, UNLINK, WRITE, Change

LOST, KEPT = (lambda: False), (lambda: True)


def change(kind, path="a", second="", inode=1, offset=0, data=b""):
    return Change(kind, path, second, inode, offset, data)


class PowerLoss(unittest.TestCase):
    def test_keeps_synced_writes_and_may_lose_later_ones(self):
        changes = [change(CREATE), change(WRITE, data=b"one"), change(SYNC), change(WRITE, offset=3, data=b"two")]
        self.assertEqual(power_loss.surviving_files(changes, LOST)[1], b"one")
        self.assertEqual(power_loss.surviving_files(changes, KEPT)[1], b"onetwo")

    def test_a_lost_write_before_a_kept_one_leaves_zeros(self):
        answers = iter((False, True))
        changes = [change(CREATE), change(WRITE, data=b"a" * 4096), change(WRITE, offset=4096, data=b"b")]
        self.assertEqual(power_loss.surviving_files(changes, lambda: next(answers))[1], bytes(4096) + b"b")

    def test_pages_of_one_write_survive_on_their_own(self):
        answers = iter((True, False, True))
        changes = [change(CREATE), change(WRITE, data=b"x" * 3 * 4096)]
        found = power_loss.surviving_files(changes, lambda: next(answers))[1]
        self.assertEqual(found, b"x" * 4096 + bytes(4096) + b"x" * 4096)

    def test_no_file_changes_its_size_after_the_cut_of_a_journal(self):
        changes = [change(CREATE), change(WRITE, data=b"one"), change(WRITE, offset=3, data=b"two"),
                   change(WRITE, data=b"ONE"), change(TRUNCATE)]
        self.assertEqual(power_loss.surviving_files(changes, KEPT, cut=2)[1], b"ONE")

    def test_names_are_durable_once_their_folder_is_synced(self):
        changes = [change(CREATE, "a.part"), change(RENAME, "a.part", "a"), change(SYNC_FOLDER, "."),
                   change(MKDIR, "b"), change(CREATE, "b/c", inode=2), change(UNLINK, "a")]
        self.assertEqual(power_loss.surviving_names(changes, LOST), ({"a": 1}, set()))
        self.assertEqual(power_loss.surviving_names(changes, KEPT), ({"b/c": 2}, {"b"}))

    def test_syncing_a_file_is_not_syncing_its_folder(self):
        changes = [change(CREATE), change(SYNC)]
        self.assertEqual(power_loss.surviving_names(changes, LOST), ({}, set()))

    def test_a_lost_rename_leaves_the_temporary_name(self):
        answers = iter((True, False))
        changes = [change(CREATE, "a.part"), change(RENAME, "a.part", "a")]
        self.assertEqual(power_loss.surviving_names(changes, lambda: next(answers))[0], {"a.part": 1})

    def test_a_journal_is_never_cut_before_the_last_sync(self):
        changes = [change(CREATE), change(SYNC), change(RENAME, second="b")]
        cuts = {power_loss.journal_cut(changes, random.Random(i)) for i in range(50)}
        self.assertEqual(cuts, {2, 3})


class Verdicts(unittest.TestCase):
    def test_only_the_allowed_codes_are_documented(self):
        self.assertEqual(lab.Outcome(5).problems({0, 5}), [])
        for code in (1, 3, -11, None):
            self.assertEqual(len(lab.Outcome(code).problems({0, 5})), 1)

    def test_a_class_fails_where_nothing_was_injected(self):
        counts = {lab.DOCUMENTED: 0, lab.DIFFERS: 0, lab.VOID: 9, lab.SKIPPED: 0}
        self.assertTrue(run_faults.failed(counts))
        self.assertTrue(run_faults.failed(counts | {lab.DOCUMENTED: 5, lab.DIFFERS: 1}))
        self.assertFalse(run_faults.failed(counts | {lab.DOCUMENTED: 1}))
        self.assertFalse(run_faults.failed(counts | {lab.SKIPPED: 1}))

    def test_an_internal_error_is_not_documented(self):
        self.assertNotIn(1, mutate_inputs.DOCUMENTED)


class Mutations(unittest.TestCase):
    def test_nearly_all_change_the_input(self):
        for mutate, content in ((mutations.of_bytes, bytes(range(200))), (mutations.of_text, b"a: 1.5\nb: 2\n"),
                                (mutations.of_table, b"stamp, x\n1,2\n3,4\n5,6\n")):
            changed = sum(mutate(content, random.Random(i)) != content for i in range(200))
            self.assertGreater(changed, 180, mutate.__name__)

    def test_every_change_of_a_database_is_valid_sqlite(self):
        with tempfile.TemporaryDirectory() as folder:
            different = 0
            for i in range(100):
                file = Path(folder) / f"{i}.sqlite"
                with sqlite3.connect(file) as database:
                    database.execute("CREATE TABLE t (a INTEGER, b TEXT)")
                    database.executemany("INSERT INTO t VALUES (?, ?)", [(1, "x"), (2, "y")])
                before = file.read_bytes()
                mutations.of_database(file, random.Random(i))
                with sqlite3.connect(file) as database:
                    self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))
                different += file.read_bytes() != before
            self.assertGreater(different, 80)


if __name__ == "__main__":
    unittest.main()
