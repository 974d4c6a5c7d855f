"""How many threads a decoder or an encoder gets."""

import os


def codec_threads() -> int:
    """Half of the processors this program may use, at least one.

    Decoding and encoding run beside each other and beside the work on frames: codecs that each take all processors
    only wait for their own threads, and cost more for it.
    """
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, usable // 2)
