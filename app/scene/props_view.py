"""What stands on the table in a scene: post, bowls, the cup and its beads."""

import numpy as np
import trimesh
import viser

from models.props import HANDLE_SIZE_M, WALL_M, Cup, Props
from models.simulation import HandState

from .poses import Poses

_POST_COLOUR = (214, 84, 60)
_BOWL_COLOURS = ((86, 150, 200), (120, 176, 120))
_CUP_COLOUR = (110, 190, 205)
_BEAD_COLOUR = (235, 125, 20)
_CUP_OPACITY = 0.45  # the beads in it are seen through its wall
_ROUND = 28


class PropsView:
    """The props of one scene; those that never move are drawn once."""

    def __init__(self, scene: viser.SceneApi, poses: Poses, props: Props) -> None:
        """Draw everything where it stands."""
        self._poses = poses
        self._cup: viser.MeshHandle | None = None
        self._beads: viser.BatchedMeshHandle | None = None
        if props.obstacle is not None:
            scene.add_cylinder(
                "/props/obstacle",
                radius=props.obstacle.radius_m,
                height=props.obstacle.height_m,
                color=_POST_COLOUR,
                position=(*props.obstacle.position, props.obstacle.height_m / 2),
                cast_shadow=False,
            )
        for index, bowl in enumerate(props.bowls):
            _add(
                scene,
                f"/props/{bowl.name}",
                _vessel(bowl.radius_m, bowl.height_m),
                _BOWL_COLOURS[index % len(_BOWL_COLOURS)],
                position=(*bowl.position, 0.0),
            )
        if props.cup is not None:
            self._cup = _add(
                scene,
                "/props/cup",
                _cup(props.cup),
                _CUP_COLOUR,
                opacity=_CUP_OPACITY,
            )
        if props.beads is not None:
            sphere = trimesh.creation.icosphere(subdivisions=1, radius=props.beads.radius_m)
            self._beads = scene.add_batched_meshes_simple(
                "/props/beads",
                vertices=np.asarray(sphere.vertices, dtype=np.float32),
                faces=np.asarray(sphere.faces, dtype=np.uint32),
                batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (props.beads.count, 1)),
                batched_positions=np.zeros((props.beads.count, 3)),
                batched_colors=_BEAD_COLOUR,
                cast_shadow=False,
                receive_shadow=False,
            )

    def update(self, cup: HandState | None, beads: np.ndarray) -> None:
        """Put cup and beads ``(n, 3)`` in [m] where they are."""
        if self._cup is not None and cup is not None:
            self._poses.put(self._cup, cup.position)
            self._poses.turn(self._cup, cup.wxyz)
        if self._beads is not None:
            self._poses.scatter(self._beads, beads)


def _add(
    scene: viser.SceneApi,
    name: str,
    mesh: trimesh.Trimesh,
    colour: tuple[int, int, int],
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    opacity: float | None = None,
) -> viser.MeshHandle:
    return scene.add_mesh_simple(
        name,
        vertices=np.asarray(mesh.vertices, dtype=np.float32),
        faces=np.asarray(mesh.faces, dtype=np.uint32),
        color=colour,
        opacity=opacity,
        side="double",
        position=position,
        cast_shadow=False,
        receive_shadow=False,
    )


def _cup(cup: Cup) -> trimesh.Trimesh:
    """A vessel with the handle by which the hand holds it, on its -x side."""
    length_m, _, height_m = HANDLE_SIZE_M
    handle = trimesh.creation.box(HANDLE_SIZE_M)
    beside_m = cup.radius_m + WALL_M + length_m / 2
    handle.apply_translation((-beside_m, 0.0, cup.height_m - height_m / 2))
    joined: trimesh.Trimesh = trimesh.util.concatenate(
        [_vessel(cup.radius_m, cup.height_m), handle]
    )
    return joined


def _vessel(radius_m: float, height_m: float) -> trimesh.Trimesh:
    """Wall and floor of an upright vessel that stands at z = 0."""
    wall = trimesh.creation.annulus(radius_m, radius_m + WALL_M, height_m, sections=_ROUND)
    wall.apply_translation((0.0, 0.0, height_m / 2))
    floor = trimesh.creation.cylinder(radius_m, WALL_M, sections=_ROUND)
    floor.apply_translation((0.0, 0.0, WALL_M / 2))
    vessel: trimesh.Trimesh = trimesh.util.concatenate([wall, floor])
    return vessel
