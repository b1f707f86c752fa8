"""What an export is put into: a zip that is sent while it is made, or a folder."""

import hashlib
import io
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Generator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any, Self

MANIFEST = "manifest-sha256.txt"
_PACKED = (".parquet", ".safetensors")  # would not get smaller


class Package(ABC):
    """Files under names, written one after the other; a context that ends with a manifest."""

    def __init__(self) -> None:
        """Begin with no file."""
        self._sums: list[str] = []

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_error: object) -> None:
        """Seal it, if all went well; otherwise it does not look whole."""
        try:
            if kind is None:
                self.seal()
        finally:
            self._let_go()

    @contextmanager
    def open(self, path: str) -> Generator["Sink"]:
        """A new file to write to, in the order in which its bytes stand."""
        with self._open(path) as file:
            sink = Sink(file)
            yield sink
        self._sums.append(f"{sink.digest}  {path}\n")

    def put(self, path: str, content: str | bytes) -> None:
        """Add a whole file."""
        with self.open(path) as file:
            file.write(content.encode() if isinstance(content, str) else content)

    def seal(self) -> None:
        """Add the SHA-256 of every file, for ``sha256sum -c``: the last thing to do."""
        with self._open(MANIFEST) as file:
            file.write("".join(self._sums).encode())

    @abstractmethod
    def _open(self, path: str) -> Any:
        """A context that gives a file to write to."""

    @abstractmethod
    def _let_go(self) -> None:
        """Nothing more is written."""


class Sink(io.RawIOBase):
    """A file that is only written to, from its beginning to its end."""

    def __init__(self, file: IO[bytes]) -> None:
        """Write to ``file``."""
        self._file, self._sum, self._at = file, hashlib.sha256(), 0

    def writable(self) -> bool:
        """It is."""
        return True

    def tell(self) -> int:
        """How many bytes were written."""
        return self._at

    def write(self, content: Any) -> int:
        """Write it all."""
        size = memoryview(content).nbytes
        self._sum.update(content)
        self._file.write(content)
        self._at += size
        return size

    @property
    def digest(self) -> str:
        """SHA-256 of what was written."""
        return self._sum.hexdigest()


class Zip(Package):
    """A zip; nothing in it is gone back to, so that it can be sent while it is made."""

    def __init__(self, target: IO[bytes]) -> None:
        """Write to ``target``, which need not be seekable."""
        super().__init__()
        self._target = target
        self._made_at = datetime.now(UTC).timetuple()[:6]

    def __enter__(self) -> Self:
        """Begin."""
        self._archive = zipfile.ZipFile(_OneWay(self._target), "w")  # type: ignore[call-overload]
        return self

    def _open(self, path: str) -> Any:
        info = zipfile.ZipInfo(path, self._made_at)
        is_packed = path.endswith(_PACKED)
        info.compress_type = zipfile.ZIP_STORED if is_packed else zipfile.ZIP_DEFLATED
        info._compresslevel = 4  # type: ignore[attr-defined]  # half the time of the usual 6
        info.external_attr = 0o644 << 16
        return self._archive.open(info, "w", force_zip64=True)

    def seal(self) -> None:
        """Add the manifest and the zip's own list of files."""
        super().seal()
        self._archive.close()

    def _let_go(self) -> None:
        # Or zipfile would end what broke off with a list of files, as if it were whole.
        self._archive.fp = None


class _OneWay:
    """Only what zipfile needs of a file that it cannot seek in."""

    def __init__(self, target: IO[bytes]) -> None:
        self._target = target

    def write(self, content: bytes) -> int:
        self._target.write(content)
        return len(content)

    def flush(self) -> None:
        self._target.flush()


class Folder(Package):
    """A folder."""

    def __init__(self, path: Path) -> None:
        """Write to ``path``, which is made."""
        super().__init__()
        path.mkdir(parents=True)
        self._path = path

    def _open(self, path: str) -> Any:
        file = self._path / path
        file.parent.mkdir(parents=True, exist_ok=True)
        return file.open("wb")

    def _let_go(self) -> None:
        pass
