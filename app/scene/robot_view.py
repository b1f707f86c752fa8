"""The Panda in a scene: one node a link, nested as the joints are, turned by joint positions."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import viser
import yourdfpy
from scipy.spatial.transform import Rotation

from models.arrays import JointPositions
from models.panda import FINGER_OPEN_M, JOINT_NAMES, LINK_NAMES
from models.panda_pack import PandaPack

from .poses import Poses

GHOST_COLOUR = (46, 134, 171)
GHOST_OPACITY = 0.35


@dataclass(frozen=True)
class _Link:
    """How one link hangs on the one before it."""

    name: str
    node: str  # "panda_link0/panda_link1/…"
    position: np.ndarray  # (3,) in the parent's frame, in [m]
    rotation: np.ndarray  # (4,) wxyz in the parent's frame, all joints at zero


@dataclass(frozen=True)
class _Joint:
    """A node that a joint turns, and its rotation with the joint at zero (wxyz)."""

    handle: viser.SceneNodeHandle
    rest: tuple[float, ...]


@cache
def _links(pack: PandaPack) -> tuple[_Link, ...]:
    robot = yourdfpy.URDF.load(
        str(pack.urdf), build_scene_graph=False, load_meshes=False, load_collision_meshes=False
    )
    joint_of = {joint.child: joint for joint in robot.joint_map.values()}
    links: dict[str, _Link] = {}
    for name in LINK_NAMES:
        # panda_link8 is a bare frame between the last link and the hand: fold it in.
        origin, parent = np.eye(4), name
        while parent in joint_of:
            joint = joint_of[parent]
            if joint.origin is not None:
                origin = joint.origin @ origin
            if joint.type == "prismatic":
                shift = np.eye(4)
                shift[:3, 3] = FINGER_OPEN_M * np.asarray(joint.axis)
                origin = origin @ shift
            parent = joint.parent
            if parent in links:
                break
        node = f"{links[parent].node}/{name}" if parent in links else name
        links[name] = _Link(name, node, origin[:3, 3].copy(), _wxyz(origin[:3, :3]))
    return tuple(links.values())


class RobotView:
    """One Panda in one scene."""

    def __init__(
        self, scene: viser.SceneApi, poses: Poses, pack: PandaPack, root: str = "/arm"
    ) -> None:
        """Add the arm under the node ``root``."""
        self._poses = poses
        scene.add_frame(root, show_axes=False)
        self._joints = _add_links(
            pack,
            root,
            lambda name, link: scene.add_glb(
                name, _glb(pack, link.name), wxyz=link.rotation, position=link.position
            ),
        )

    def update(self, q: JointPositions) -> None:
        """Turn the arm to ``q`` ``(7,)`` in [rad]."""
        _turn(self._poses, self._joints, q)


class GhostView:
    """A see-through Panda that shows where a move ends."""

    def __init__(
        self, scene: viser.SceneApi, poses: Poses, pack: PandaPack, root: str = "/ghost"
    ) -> None:
        """Add the ghost, unseen at first."""
        self._poses = poses
        self._frame = scene.add_frame(root, show_axes=False, visible=False)

        def add(name: str, link: _Link) -> viser.SceneNodeHandle:
            if link.name == LINK_NAMES[0]:
                # The base never moves; drawn twice it would flicker.
                return scene.add_frame(name, show_axes=False)
            vertices, faces = pack.ghost_mesh(link.name)
            return scene.add_mesh_simple(
                name,
                vertices,
                faces,
                color=GHOST_COLOUR,
                opacity=GHOST_OPACITY,
                cast_shadow=False,
                receive_shadow=False,
                wxyz=link.rotation,
                position=link.position,
            )

        self._joints = _add_links(pack, root, add)

    def show(self, q: JointPositions) -> None:
        """Stand at ``q`` ``(7,)`` in [rad]."""
        _turn(self._poses, self._joints, q)
        self._frame.visible = True

    def hide(self) -> None:
        """Be gone."""
        self._frame.visible = False


_MOVED_LINKS = LINK_NAMES[1 : len(JOINT_NAMES) + 1]


def _add_links(
    pack: PandaPack, root: str, add: Callable[[str, _Link], viser.SceneNodeHandle]
) -> list[_Joint]:
    """Add every link, parents first; give back the seven that a joint turns."""
    handles = {link.name: (add(f"{root}/{link.node}", link), link) for link in _links(pack)}
    return [
        _Joint(handles[name][0], tuple(handles[name][1].rotation.tolist())) for name in _MOVED_LINKS
    ]


def _turn(poses: Poses, joints: list[_Joint], q: JointPositions) -> None:
    half = 0.5 * np.asarray(q)
    cosines, sines = np.cos(half).tolist(), np.sin(half).tolist()
    for joint, c, s in zip(joints, cosines, sines, strict=True):
        w, x, y, z = joint.rest
        # A joint's own axis is its z: the rest rotation times (c, 0, 0, s).
        poses.turn(joint.handle, (w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s))


@cache
def _glb(pack: PandaPack, link: str) -> bytes:
    # The same bytes for every scene: viser keeps them by reference.
    return pack.visual_glb(link)


def _wxyz(rotation: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(rotation).as_quat(scalar_first=True)
