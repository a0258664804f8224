"""Ask the user to decide what a file leaves open."""

import re

from capsule.errors import CapsuleError


class QuestionError(CapsuleError):
    """The error of a file that can be read in several ways; its text names the deciding options."""

    @property
    def subject(self) -> str:
        """The text without its numbers and quoted cells, the same for files of one kind."""
        return re.sub(r"[+-]?[0-9][0-9.,e+-]*", "0", re.sub(r"'[^']*'", "", str(self)))
