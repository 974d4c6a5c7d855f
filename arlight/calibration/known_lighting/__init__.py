"""The sheet under light that is known: layers, single blocks, and the paper's own fixed matrix."""
