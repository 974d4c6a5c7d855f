"""Where blocks lie in the image, against rays traced through the pixels one by one."""

import numpy as np

from arlight.probe.layout import design_probe
from arlight.tracking.block_layout import BlockLayout, field_blocks

PROBE = design_probe(order=3)
LAYOUT = BlockLayout.of_probe(PROBE)


def test_the_wedge_does_not_measure_light():
    blocks = field_blocks(PROBE)
    assert {block.kind for block in PROBE.blocks} - {block.kind for block in blocks} == {"wedge"}
    assert len(LAYOUT.centers_mm) == len(LAYOUT.half_mm) == len(LAYOUT.cycles_per_mm) == len(blocks)


def test_stripes_have_the_period_of_their_frequency():
    for block, cycles in zip(field_blocks(PROBE), LAYOUT.cycles_per_mm, strict=True):
        u, v = block.frequency or (0, 0)
        np.testing.assert_allclose(cycles * PROBE.slab.period_mm, (u, v), atol=1e-12)
