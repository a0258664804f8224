"""A lock on an open file that the system itself takes back, however the process that holds it ends.

Imports nothing heavy: the Snakefile uses it.
"""

import os
import sys

if sys.platform == "win32":
    import msvcrt

    # Windows locks bytes, and keeps others from reading them: one far behind any file's end.
    _LOCKED_BYTE = 2**31 - 2

    def lock_file(descriptor: int) -> None:
        """Lock a file for as long as it is open."""
        position = os.lseek(descriptor, 0, os.SEEK_CUR)
        os.lseek(descriptor, _LOCKED_BYTE, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except PermissionError as fault:
            raise BlockingIOError(*fault.args) from fault
        finally:
            os.lseek(descriptor, position, os.SEEK_SET)

else:
    import fcntl

    def lock_file(descriptor: int) -> None:
        """Lock a file for as long as it is open.

        Parameters
        ----------
        descriptor : int
            Of the open file.

        Raises
        ------
        BlockingIOError
            Another process holds the lock.
        OSError
            The file system knows no locks.
        """
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
