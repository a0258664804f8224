"""Lock an open file; the operating system releases the lock when the process ends.

The locked files hold data: a recording, or the name of the process that holds the lock. Libraries
do not fit that: `filelock` empties the file that it locks, and `portalocker` locks the whole
file on Windows, so that no other process can read it.

The Snakefile uses this module, so it imports only fast modules.
"""

import os
import sys

if sys.platform == "win32":
    import msvcrt

    # Other processes cannot read a byte that is locked on Windows, so the locked byte lies far
    # behind the end of any file.
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
            Descriptor of the open file.

        Raises
        ------
        BlockingIOError
            Another process holds the lock.
        OSError
            The file system does not support locks.
        """
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
