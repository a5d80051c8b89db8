"""Pictures and figures of the GPU programs in docs/systems, drawn on one scene."""
