"""What other programs call the lens models, and which coefficients each takes. Pure.

Sources: ROS, sensor_msgs/distortion_models.hpp; Kalibr, "Supported models" of its wiki; the EuRoC data set's sensor.yaml;
COLMAP, src/colmap/sensor/models.h.
"""

from dataclasses import dataclass
from typing import Final

from common.errors import DataError
from common.words import counted
from phone_host.model import Lens
from phone_host.output.rig_files.stated import StatedCamera
from phone_host.output.rig_files.tree import Node


@dataclass(frozen=True, slots=True)
class NamedLens:
    """A lens model under the name that a program gives it.

    Attributes:
        name: that name.
        lens: the model.
        counts: how many coefficients may be stated; those that are not stated are 0.
    """

    name: str
    lens: Lens
    counts: tuple[int, ...]


Names = tuple[NamedLens, ...]

ROS_LENSES: Final[Names] = (
    NamedLens("plumb_bob", Lens.PINHOLE, (0, 4, 5)),
    NamedLens("rational_polynomial", Lens.RATIONAL, (0, 4, 5, 8, 12, 14)),
    NamedLens("equidistant", Lens.FISHEYE, (4,)),
    NamedLens("none", Lens.PINHOLE, (0, 4, 5)),
)
KALIBR_LENSES: Final[Names] = (
    NamedLens("radtan", Lens.PINHOLE, (4,)),
    NamedLens("none", Lens.PINHOLE, (0, 1, 4)),
    NamedLens("equidistant", Lens.FISHEYE, (4,)),
)
EUROC_LENSES: Final[Names] = (
    NamedLens("radial-tangential", Lens.PINHOLE, (4,)),
    NamedLens("radtan", Lens.PINHOLE, (4,)),
    NamedLens("equidistant", Lens.FISHEYE, (4,)),
)


def lens_of(name: Node, coefficients: Node, names: Names) -> tuple[Lens, tuple[float, ...]]:
    """Read which lens a file names, and its coefficients.

    Drivers state eight coefficients for every model, so those beyond what the model has are left out if they are 0.

    Args:
        name: the model's name.
        coefficients: its coefficients.
        names: the models that the program knows and this one can read.

    Raises:
        DataError: the model is not known here, or has another number of coefficients.
    """
    word = name.word()
    known = next((each for each in names if each.name == word), None)
    if known is None:
        raise name.problem(f"is {word!r}", f"read are {', '.join(each.name for each in names)}")
    values = coefficients.values()
    limit = max(known.counts)
    if any(values[limit:]):
        raise coefficients.problem(
            f"has {counted(len(values), 'value')}", f"{word} has at most {limit}: name the model that has them all"
        )
    values = values[:limit]
    if len(values) not in known.counts:
        stated = f"has {counted(len(values), 'value')}"
        raise coefficients.problem(stated, f"{word} has {' or '.join(map(str, known.counts))}")
    if word == "none" and any(values):
        raise coefficients.problem("bends rays", f"but {name.key} is none; name the model")
    length = 8 if known.lens is Lens.RATIONAL else 4
    return known.lens, values + (0.0,) * (length - len(values))


def lens_name(camera: StatedCamera, names: Names, program: str) -> NamedLens:
    """Return the model under which a program takes a camera; its coefficients are to be padded to the largest count.

    Raises:
        DataError: the program has no model that holds all of the camera's coefficients.
    """
    found = next(
        (each for each in names if each.lens is camera.lens and max(each.counts) >= len(camera.coefficients)), None
    )
    if found is None:
        raise DataError(
            f"{program} cannot hold {camera.name}: a {camera.lens.value} lens of {len(camera.coefficients)} coefficients",
            "export it as opencv, ros or colmap",
        )
    return found


def padded_coefficients(camera: StatedCamera, count: int) -> tuple[float, ...]:
    """Return a camera's coefficients with zeros added up to a count."""
    return (*camera.coefficients, *(0.0,) * (count - len(camera.coefficients)))
