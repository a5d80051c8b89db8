"""A judged image with all that is known about it: what the page of verdicts has a part for."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from volref.arrays import Booleans, Floats
from volref.errors import SceneError
from volref.oracle.acceptance import Acceptance
from volref.oracle.explanation import NONE, Explanation
from volref.oracle.verdict import LOW_QUALITY, NOT_COMPARABLE, Verdict

# What can come of a case, the worst first: outside, too wide an interval to say, inside with low-quality
# filtering only, inside.
KINDS = ("fail", "open", "warn", "pass")


@dataclass(frozen=True, eq=False)
class Case:
    """One judged image.

    Parameters
    ----------
    name
        What the image is of.
    acceptance, verdict
        What a correct machine may draw, and what came of the comparison.
    explanation
        Why the image is outside; None if nobody asked.
    passes
        Targets of the emulation by name, in the order of drawing, see `Emulation.passes`.
    provenance
        What is known of where all this comes from, by name: hashes, plan, times, the error of the truth.
        Versions, pipeline and device are on the page anyway.
    """

    name: str
    acceptance: Acceptance
    verdict: Verdict
    explanation: Explanation | None = None
    passes: Mapping[str, Floats] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse a verdict or an explanation on images of another size than the intervals."""
        size = self.acceptance.drawn.shape
        images: dict[str, Floats | Booleans] = {"verdict": self.verdict.outside}
        if self.counterfactual is not None:
            images["explanation.counterfactual"] = self.counterfactual
        for name, image in images.items():
            if image.shape[:2] != size:
                got = " x ".join(map(str, image.shape[1::-1]))
                message = (
                    f"{name} must be on an image of {size[1]} x {size[0]} pixels as acceptance, got {got}; "
                )
                raise SceneError(message + "judge it by the intervals of its own scene")

    @property
    def kind(self) -> str:
        """What came of it, one of KINDS."""
        if self.verdict.status.startswith(NOT_COMPARABLE):
            return "open"
        if not self.verdict.passed:
            return "fail"
        return "warn" if self.verdict.status.startswith(LOW_QUALITY) else "pass"

    @property
    def why(self) -> Explanation | None:
        """The explanation, if there is anything to explain."""
        return None if self.explanation is None or self.explanation.status == NONE else self.explanation

    @property
    def counterfactual(self) -> Floats | None:
        """What a program with the likeliest fault draws, if one was found."""
        return None if self.why is None else self.why.counterfactual

    @property
    def judges_alpha(self) -> bool:
        """Whether the image has an alpha that was looked at."""
        return bool(self.verdict.candidate.shape[-1] == 4)

    @property
    def candidate(self) -> Floats:
        """The canvas that was judged (H, W, 4); where its alpha was not looked at, the nominal one's."""
        judged, nominal = self.verdict.candidate, self.acceptance.nominal
        return judged if self.judges_alpha else np.concatenate([judged, nominal[..., 3:]], axis=-1)
