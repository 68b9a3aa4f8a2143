"""Files that are written whole or not at all."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from .errors import OutputError

_DRAFT = ".unassemble-"
PICTURES = (".png", ".svg", ".pdf")


@contextmanager
def whole_file(path: str | os.PathLike[str], suffix: str) -> Iterator[Path]:
    """Where to write a draft of `path`, whose name ends with `suffix`; it takes its place only if the block ends well.

    The draft lies in a folder of its own beside the target, a link being followed, so that side files of a writer
    vanish with it and the last step is a rename within one file system. An old file stays as it is until then.

    Raises OutputError if the system refuses to write.
    """
    try:
        target = Path(path).resolve()
        # An unclosed handle must not turn a good result into a failure where open files cannot be removed.
        with TemporaryDirectory(prefix=_DRAFT, dir=target.parent, ignore_cleanup_errors=True) as folder:
            draft = Path(folder) / f"draft{suffix}"
            yield draft
            draft.replace(target)
    except (OSError, ValueError) as error:
        raise OutputError(f"cannot write {os.fspath(path)!r}: {_reason(error)}") from error


def check_target(path: str | os.PathLike[str]) -> None:
    """Raise OutputError, before long work, where a file cannot be written.

    Its folder is missing or closed to us, or something other than a file of ours has the name.
    """
    name = os.fspath(path)
    try:
        target = Path(path).resolve()
        if target.is_dir():
            raise OutputError(f"cannot write {name!r}: it is a folder, so name a file in it")
        if target.exists() and not target.is_file():
            raise OutputError(f"cannot write {name!r}: it is not a regular file")
        if not target.parent.is_dir():
            raise OutputError(f"cannot write {name!r}: there is no folder {str(target.parent)!r}")
        if target.exists() and not os.access(target, os.W_OK):
            raise OutputError(f"cannot write {name!r}: the file that is there is write-protected")
        with TemporaryDirectory(prefix=_DRAFT, dir=target.parent):
            pass  # permissions are best judged by trying
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: a loop of links
        raise OutputError(f"cannot write {name!r}: {_reason(error)}") from error


def check_plot(path: str | os.PathLike[str]) -> None:
    """Raise OutputError, before long work, where a picture cannot be written, or its extension is another one."""
    if Path(path).suffix.lower() not in PICTURES:
        raise OutputError(f"a picture is a {' or '.join(PICTURES)} file, not {os.fspath(path)!r}")
    check_target(path)


def _reason(error: BaseException) -> str:
    return (getattr(error, "strerror", None) or str(error)).lower()
