"""Read the files of a survey."""

from pathlib import Path

from capsule.files import read_limited
from capsule.survey.listed import LARGEST_BYTES
from capsule.survey.session_names import FILES
from capsule.survey.stored_session import Session, SessionError, parse_session


def read_session(folder: Path) -> Session:
    """Read a survey.

    Raises
    ------
    SessionError
        A file cannot be read; the message names the file and the reason.
    """
    contents = {}
    for file in FILES:
        try:
            content = read_limited(folder / file, LARGEST_BYTES)
        except OSError as error:
            raise SessionError(f"{file}: {error.strerror}") from error
        if content is None:
            raise SessionError(f"{file}: larger than {LARGEST_BYTES / 1e6:g} MB")
        contents[file] = content
    return parse_session(folder.name, contents)
