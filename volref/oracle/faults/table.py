"""All faults by key, in the order of the table of faults: one row each, or some."""

from volref.oracle.faults.atlas import ATLAS
from volref.oracle.faults.color import COLOR
from volref.oracle.faults.depth import DEPTH
from volref.oracle.faults.fault import Fault
from volref.oracle.faults.filtering import FILTERING
from volref.oracle.faults.geometry import GEOMETRY
from volref.oracle.faults.normals import NORMALS
from volref.oracle.faults.opacity import OPACITY
from volref.oracle.faults.stepping import STEPPING
from volref.oracle.faults.table_texture import TABLE

GROUPS = (ATLAS, GEOMETRY, OPACITY, STEPPING, TABLE, FILTERING, DEPTH, COLOR, NORMALS)

FAULTS: dict[str, Fault] = {fault.key: fault for group in GROUPS for fault in group}
