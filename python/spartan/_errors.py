"""The error of everything that can fail for outside reasons."""

from __future__ import annotations


class Error(Exception):
    """What happened, where, and what to do about it.

    code: what a caller can act on: `usage`, `input`, `frame_rejected`, `store_damaged`, `configuration`, `output`,
        `read_error`, `resources`, `interrupted` or `internal` (docs/architecture.md, "Errors").
    what: what happened.
    where: file, line or key; may be empty.
    hint: what to do; may be empty.
    """

    def __init__(self, code: str, what: str, where: str = "", hint: str = "") -> None:
        super().__init__(code, what, where, hint)
        self.code = code
        self.what = what
        self.where = where
        self.hint = hint

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}" if self.where else self.what
        return f"{text} ({self.hint})" if self.hint else text
