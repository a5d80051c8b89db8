"""Why some faults are caught on no chart, or told from another one on none: by "key", or "key other"."""

REASONS: dict[str, str] = {
    "T1-above-one": "alpha that is put together by *over* does not exceed 1, and the programs that divide by "
    "a larger one, `vpt-eam` and `cej2020`, put it together so; it shows with `add-alpha` alone"
}
