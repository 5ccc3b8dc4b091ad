"""Mutations of input files: bytes, text, tables, SQLite databases; YAML attacks. Every choice is drawn from `rng`."""
import sqlite3
import struct
import zlib

NUMBERS = ("nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-0", "-1", "1e9", "0.5", "2147483647", "2147483648",
           "-2147483649", "9223372036854775807", "9223372036854775808", "-9223372036854775809", "1" + "0" * 400, "0x10",
           "1e", "--1", "1,5", "", "٣")
INSERTS = (b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"\n", b"\r", b"\t", b"#", b":", b"'", b'"', b"{", b"[", b",", b"%n%s",
           b"\xc3\x28", b"../../etc/passwd", b" " * 5000)
SQL_VALUES = ("NULL", "0", "-1", "1e308", "-1e308", "9e999", "9223372036854775807", "-9223372036854775808",
              "2147483648", "''", "'text'", "x''", "x'00'", "zeroblob(56)", "zeroblob(288)", "randomblob(100)",
              "zeroblob(20000000)")


def _span(data, rng):
    begin = rng.randrange(len(data) + 1)
    return begin, min(len(data), begin + rng.choice((1, 2, 4, 16, 64, 1000)))


def _flip(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 3, 20)) if data else 0):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(data)


def _cut(data, rng):
    return data[:rng.randrange(len(data) + 1)]


def _drop(data, rng):
    begin, end = _span(data, rng)
    return data[:begin] + data[end:]


def _repeat(data, rng):
    begin, end = _span(data, rng)
    return data[:end] + data[begin:end] * rng.choice((1, 2, 50)) + data[end:]


def _insert(data, rng):
    begin, _ = _span(data, rng)
    return data[:begin] + rng.choice(INSERTS) + data[begin:]


def _extreme_bytes(data, rng):
    """Four bytes become the length or size that overflows."""
    begin = rng.randrange(len(data) + 1)
    extreme = rng.choice((b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\0\0\0\0", b"\x80\0\0\0"))
    return data[:begin] + extreme + data[begin + 4:]


def _number(data, rng):
    starts = [i for i, byte in enumerate(data) if 48 <= byte < 58 and (i == 0 or data[i - 1] not in b"0123456789.eE+-")]
    if not starts:
        return _flip(data, rng)
    begin = end = rng.choice(starts)
    while end < len(data) and data[end] in b"0123456789.eE+-":
        end += 1
    return data[:begin] + rng.choice(NUMBERS).encode() + data[end:]


def _lines(data, rng):
    lines = data.split(b"\n")
    i = rng.randrange(len(lines))
    kind = rng.randrange(4)
    if kind == 0:
        rng.shuffle(lines)
    elif kind == 1:
        del lines[i]
    elif kind == 2:
        lines.insert(i, lines[rng.randrange(len(lines))])
    else:
        lines[i:] = reversed(lines[i:])
    return b"\n".join(lines)


BINARY = (_flip, _cut, _drop, _repeat, _insert, _extreme_bytes)
TEXT = (_number, _number, _number, _lines, _flip, _cut, _drop, _repeat, _insert)


def of_bytes(data, rng):
    for _ in range(rng.choice((1, 1, 2, 4))):
        data = rng.choice(BINARY)(data, rng)
    return data


def of_text(data, rng):
    for _ in range(rng.choice((1, 1, 2, 4))):
        data = rng.choice(TEXT)(data, rng)
    return data


def of_table(data, rng):
    """Stamps and values of a table: extreme, doubled, reversed, in one row, one column or everywhere."""
    lines = data.decode("utf-8").splitlines()
    first = 1 if any(character.isalpha() for character in lines[0]) else 0
    separator = "," if "," in lines[-1] else " "
    rows = [line.split(separator) for line in lines[first:]]
    kind, column, value = rng.randrange(6), rng.randrange(len(rows[0])), rng.choice(NUMBERS)
    row = rng.randrange(len(rows))
    if kind == 0:
        rows[row][min(column, len(rows[row]) - 1)] = value
    elif kind == 1:
        for cells in rows:
            cells[min(column, len(cells) - 1)] = value
    elif kind == 2:
        rows[row:] = [list(cells) for cells in reversed(rows[row:])]
    elif kind == 3:
        rows.insert(row, list(rows[row]))
    elif kind == 4:
        del rows[row][column:]
    else:
        return of_text(data, rng)
    return "\n".join([*lines[:first], *(separator.join(cells) for cells in rows)]).encode() + b"\n"


def _statements(database, rng):
    """One change of the content or of the shape of a database, as SQL."""
    tables = [row[0] for row in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
              if not row[0].startswith("sqlite_")]
    if not tables:
        return "PRAGMA user_version = 7"
    table = rng.choice(tables)
    columns = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
    column, value = rng.choice(columns), rng.choice(SQL_VALUES)
    endless = ("WITH RECURSIVE n(i) AS (VALUES(1) UNION ALL SELECT i + 1 FROM n) SELECT "
               + ", ".join(f"i AS {name}" for name in columns) + " FROM n")
    return rng.choice((
        f"UPDATE OR REPLACE {table} SET {column} = {value}",
        f"UPDATE OR REPLACE {table} SET {column} = {value} WHERE {column} = (SELECT max({column}) FROM {table})",
        f"UPDATE OR REPLACE {table} SET {column} = {column} || 'x'",
        f"UPDATE OR REPLACE {table} SET {column} = substr({column}, 1, length({column}) / 2)",
        f"UPDATE OR REPLACE {table} SET {column} = substr({column}, 1, 40) || x'FF' || substr({column}, 42)",
        f"UPDATE OR REPLACE {table} SET {column} = -{column}",
        f"UPDATE OR REPLACE {table} SET {column} = {column} + 1000000000",
        f"DELETE FROM {table}",
        f"DELETE FROM {table} WHERE {column} = (SELECT max({column}) FROM {table})",
        f"DROP TABLE {table}",
        f"ALTER TABLE {table} DROP COLUMN {column}",
        f"ALTER TABLE {table} RENAME COLUMN {column} TO other",
        f"ALTER TABLE {table} ADD COLUMN more",
        f"DROP TABLE {table}; CREATE VIEW {table} AS {endless}",
        f"CREATE TRIGGER attack AFTER INSERT ON {table} BEGIN DELETE FROM {table}; END",
        f"PRAGMA user_version = {rng.choice((-1, 0, 1, 999))}",
        f"PRAGMA application_id = {rng.choice((0, 7))}",
        "PRAGMA encoding = 'UTF-16'; VACUUM",
    ))


def of_database(file, rng):
    """Valid SQLite with other content or other tables."""
    database = sqlite3.connect(file, isolation_level=None)
    for _ in range(rng.choice((1, 1, 2))):
        try:
            database.executescript(_statements(database, rng))
        except sqlite3.Error:
            pass  # e.g. the last column of a table: another trial has it
    database.close()


def of_stage_memory(file, rng):
    """The saved state of all stages, byte by byte."""
    database = sqlite3.connect(file)
    (state,) = database.execute("SELECT stages FROM memory").fetchone()
    database.execute("UPDATE memory SET stages = ?", (of_bytes(state, rng),))
    database.commit()
    database.close()


def image_attacks():
    """Headers that claim far more than the file holds, by name of the file."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    def png(width, height, bits, data, extra=b""):
        header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0))
        return b"\x89PNG\r\n\x1a\n" + header + extra + chunk(b"IDAT", data) + chunk(b"IEND", b"")

    zeros = zlib.compress(bytes(1 << 24), 9)
    return {
        "bomb.png": png(11585, 11585, 1, zlib.compress(bytes(11585 * 1450), 9)),
        "wide.png": png(2147483647, 1, 8, zeros), "vast.png": png(65535, 65535, 8, zeros),
        "empty.png": png(0, 0, 8, b""), "deep.png": png(8, 8, 77, zeros),
        "text.png": png(8, 8, 8, zlib.compress(bytes(72)), chunk(b"zTXt", b"a\0\0" + zeros)),
        "vast.pgm": b"P5 65535 65535 255\n" + bytes(100), "negative.pgm": b"P5 -8 8 255\n" + bytes(64),
        "levels.pgm": b"P5 8 8 99999\n" + bytes(64), "vast.pfm": b"Pf\n65535 65535\n-1\n" + bytes(64),
        "scale.pfm": b"Pf\n8 8\nnan\n" + bytes(256), "ascii.pgm": b"P2 8 8 255\n" + b"9" * 100000,
        "vast.jpg": b"\xff\xd8\xff\xc0\x00\x0b\x08\xff\xff\xff\xff\x01\x01\x11\x00\xff\xd9",
    }


def yaml_attacks():
    """Texts, by name."""
    laughs = "".join(f"{chr(98 + i)}: &{chr(98 + i)} [{', '.join(['*' + chr(97 + i)] * 9)}]\n" for i in range(9))
    return {
        "billion laughs": f"a: &a [x, x, x, x, x, x, x, x, x]\n{laughs}".encode(),
        "cycle of aliases": b"schema: 1\na: &a {b: *a}\n",
        "cycle of lists": b"a: &a [*a]\n",
        "100 000 brackets": b"[" * 100_000,
        "100 000 braces": b"{a: " * 100_000,
        "10 000 levels": "".join(" " * i + "a:\n" for i in range(0, 4000)).encode(),
        "100 MB of lines": b"key: [1, 2, 3]\n" * 7_000_000,
        "30 MB of one key": b"a" * 30_000_000 + b": 1\n",
        "100 000 keys": b"".join(b"key%d: 1\n" % i for i in range(100_000)),
        "merge key": b"base: &base {schema: 1}\nother:\n  <<: *base\n",
        "merge of itself": b"a: &a\n  <<: *a\n",
        "python tag": b"!!python/object/apply:os.system ['true']\n",
        "binary tag": b"schema: !!binary AQ==\n",
        "NUL": b"schema: 1\0\nname: x\n",
        "UTF-16": "schema: 1\nname: x\n".encode("utf-16"),
        "not UTF-8": b"schema: 1\nname: \xff\xfe\n",
        "two documents": b"schema: 1\n---\nschema: 1\n",
        "directive": b"%YAML 9.9\n---\nschema: 1\n",
        "tabs": b"schema:\t1\n\tname: x\n",
        "no end": b"name: 'x\n", "a list": b"- 1\n- 2\n", "a number": b"7\n", "nothing": b"",
        "repeated keys": b"schema: 1\nschema: 1\n",
        "a key that is a map": b"? {a: b}\n: 1\n",
    }
