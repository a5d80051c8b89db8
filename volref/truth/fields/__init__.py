"""What a march goes through: a scene's volume as a field that can be sampled and classified.

A plain field is looked up by its value alone; the others take more, and only where the scene asks for it.
"""

from volref.planning import Plan
from volref.scene.radar import RadarVolume
from volref.scene.scene import Scene
from volref.truth.fields.field import Field, Samples
from volref.truth.fields.plain import PlainField, plain_field
from volref.truth.fields.polar import polar_field
from volref.truth.fields.preclassified import preclassified_field, sliced_field
from volref.truth.fields.shaded import shaded_field

__all__ = ["Field", "PlainField", "Samples", "field_of", "plain_field"]


def field_of(scene: Scene, plan: Plan) -> Field:
    """Prepare the volume of `scene` for marching; the first time it costs a pass or a few over its voxels."""
    if isinstance(scene.volume, RadarVolume):
        return polar_field(scene, plan)
    if scene.classification == "pre":
        return preclassified_field(scene, plan)
    if scene.classification == "per-slice":
        return sliced_field(scene, plan)
    if scene.needs_gradient:
        return shaded_field(scene, plan)
    return plain_field(scene, plan)
