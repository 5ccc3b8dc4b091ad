"""Damaged and hostile variants of input files; every mutation is drawn from a random.Random."""
import shutil
import sqlite3

EXTREME_NUMBERS = ["nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-1", "1e9", "2147483647", "-2147483648",
                   "9223372036854775807", "-9223372036854775808", "99999999999999999999999", "0x10", "1e", "--1", ""]


def _flip(data, draw):
    for _ in range(draw.choice([1, 1, 3, 20])):
        data[draw.randrange(len(data))] ^= 1 << draw.randrange(8)


def _truncate(data, draw):
    del data[draw.randrange(len(data)):]


def _remove(data, draw):
    at = draw.randrange(len(data))
    del data[at : at + draw.choice([1, 4, 50, 1000])]


def _repeat(data, draw):
    at = draw.randrange(len(data))
    part = data[at : at + draw.choice([1, 4, 50, 1000])]
    data[at:at] = part * draw.choice([1, 2, 100])


def _insert(data, draw):
    at = draw.randrange(len(data) + 1)
    data[at:at] = draw.choice([b"\0", b"\xff\xfe", b"\n", b"\r\n", b"\t", b"#", b":", b"'", b"\xc3\x28", bytes(draw.randbytes(8))])


def _number(data, draw):
    """Replaces a number of a text."""
    digits = [i for i, byte in enumerate(data) if chr(byte).isdigit() and (i == 0 or not chr(data[i - 1]).isdigit())]
    if not digits:
        return _flip(data, draw)
    begin = end = draw.choice(digits)
    while end < len(data) and chr(data[end]) in "0123456789.eE+-":
        end += 1
    data[begin:end] = draw.choice(EXTREME_NUMBERS).encode()


def _shuffle_lines(data, draw):
    lines = bytes(data).split(b"\n")
    draw.shuffle(lines)
    data[:] = b"\n".join(lines)


BYTES = [_flip, _truncate, _remove, _repeat, _insert]
TEXT = [*BYTES, _number, _number, _number, _shuffle_lines]


def mutate_bytes(content, draw, is_text):
    data = bytearray(content)
    if draw.random() < 0.02:
        return b""
    for _ in range(draw.choice([1, 1, 2, 4])):
        if data:
            draw.choice(TEXT if is_text else BYTES)(data, draw)
    return bytes(data)


SQL_VALUES = ["NULL", "0", "-1", "1e308", "-1e308", "9223372036854775807", "-9223372036854775808", "2147483648", "''",
              "'text'", "x''", "x'00'", "zeroblob(56)", "zeroblob(288)", "randomblob(100)", "9e999"]


def mutate_database(path, draw):
    """Valid SQLite with other content, or other tables."""
    db = sqlite3.connect(path)
    db.isolation_level = None
    tables = [row[0] for row in db.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")]
    for _ in range(draw.choice([1, 1, 2])):
        table = draw.choice(tables)
        columns = [row[1] for row in db.execute(f"PRAGMA table_info({table})")]
        column, value = draw.choice(columns), draw.choice(SQL_VALUES)
        where = draw.choice(["", f" WHERE rowid % 2 = {draw.randrange(2)}", " WHERE 1 = 1"])
        endless = "WITH RECURSIVE n(i) AS (VALUES(1) UNION ALL SELECT i + 1 FROM n) SELECT " + ", ".join(f"i AS {c}" for c in columns) + " FROM n"
        statement = draw.choice([
            f"UPDATE OR REPLACE {table} SET {column} = {value}{where}",
            f"UPDATE OR REPLACE {table} SET {column} = {value}{where}",
            f"UPDATE OR REPLACE {table} SET {column} = {column} || 'x'",
            f"UPDATE OR REPLACE {table} SET {column} = substr({column}, 1, length({column}) / 2)",
            f"UPDATE OR REPLACE {table} SET {column} = substr({column}, 1, 40) || x'FF' || substr({column}, 42)",
            f"DELETE FROM {table}", f"DELETE FROM {table} WHERE rowid IN (SELECT rowid FROM {table} LIMIT 1)",
            f"INSERT OR IGNORE INTO {table} SELECT * FROM {table}", f"DROP TABLE {table}",
            f"ALTER TABLE {table} DROP COLUMN {column}", f"ALTER TABLE {table} RENAME COLUMN {column} TO other",
            f"ALTER TABLE {table} ADD COLUMN more", f"DROP TABLE {table}; CREATE VIEW {table} AS {endless}",
            f"CREATE TRIGGER t AFTER INSERT ON {table} BEGIN DELETE FROM {table}; END",
            f"PRAGMA user_version = {draw.choice([-1, 0, 1, 999])}", f"PRAGMA application_id = {draw.choice([0, 7])}",
        ])
        try:
            db.executescript(statement)
        except sqlite3.Error:
            pass  # e.g. the last column of a table
        tables = [row[0] for row in db.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")]
        if not tables:
            break
    db.close()


def yaml_attacks():
    """Name and text of each."""
    laughs = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join(['*' + chr(97 + i)] * 9)}]\n" for i in range(9))
    return {
        "billion laughs": laughs.encode(),
        "cycle of aliases": b"a: &a [*a]\n",
        "100 000 brackets": b"[" * 100_000,
        "100 000 maps": "".join(" " * min(i, 2000) + "a:\n" for i in range(100_000)).encode(),
        "4 MB of one key": b"a" * 4_000_000 + b": 1\n",
        "merge key": b"base: &base {schema: 1}\nother:\n  <<: *base\n",
        "tags": b"!!python/object/apply:os.system ['true']\n",
        "NUL": b"schema: 1\0\nname: x\n",
        "UTF-16": "schema: 1\n".encode("utf-16"),
        "two documents": b"schema: 1\n---\nschema: 1\n",
        "tabs": b"schema:\t1\n\tname: x\n",
        "no end": b"name: 'x\n",
        "a list": b"- 1\n- 2\n",
        "a number": b"7\n",
        "repeated keys": b"schema: 1\nschema: 1\n",
    }


def copy_tree(source, target):
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(source, target)
