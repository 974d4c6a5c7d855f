"""How many threads a decoder or an encoder gets."""

import os


def decoder_threads() -> int:
    """Half of the processors this program may use, at least one.

    Decoding and encoding run beside each other and beside the work on frames: codecs that each take all processors
    only wait for their own threads, and cost more for it.
    """
    return max(1, _processors() // 2)


def encoder_threads() -> int:
    """One more, at least two: whoever hands over a frame need then not wait until it is compressed."""
    return decoder_threads() + 1


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
