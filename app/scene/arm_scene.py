"""What a participant sees: the arm on its table, where it may go, and the move of a question."""

from collections.abc import Sequence

import numpy as np
import viser

from models.arrays import JointPositions
from models.panda_pack import PandaPack
from models.simulation import HandState
from models.tasks import Task

from .cameras import camera_of
from .props_view import PropsView
from .robot_view import GHOST_COLOUR, GhostView, RobotView
from .server import SceneServer, SceneSocket

_TABLE_COLOUR = (78, 92, 108)
_REACH_COLOUR = (190, 208, 222)
_HAND_COLOUR = (255, 140, 40)
_SKY = np.linspace((232, 237, 242), (196, 206, 216), 64)  # from top to bottom
_LIGHT = 0.45  # of viser's environment light: a white arm must not burn out
_CAMERA_FOV_RAD = 0.72
# Up, right, down, left; the page's pad has them, too (static/css/colors.css).
ARROW_COLOURS = ((0, 114, 178), (168, 69, 127), (200, 82, 0), (0, 128, 92))
_TRAIL_THICKNESS_M = 0.008
_SEEN_WAY_M = 0.01  # no arrow shows a shorter way


class ArmScene:
    """One participant's picture. Make it on the event loop."""

    def __init__(self, pack: PandaPack, task: Task) -> None:
        """Set up table, arm, ghost and the task's props, and mark where the hand may go."""
        self._server = SceneServer()
        scene, poses = self._server.viser.scene, self._server.poses
        camera = camera_of(task.name)
        self._server.viser.initial_camera.position = camera.position
        self._server.viser.initial_camera.look_at = camera.look_at
        self._server.viser.initial_camera.fov = _CAMERA_FOV_RAD
        scene.set_background_image(np.repeat(_SKY[:, None], 8, axis=1).astype(np.uint8))
        scene.configure_environment_map(environment_intensity=_LIGHT)
        # Shadows double the price of a frame, which a page without a graphics card pays with its
        # main thread, and so with the stick; the plumb line tells the depth instead.
        scene.configure_default_lights(cast_shadow=False)
        scene.add_box(
            "/table",
            dimensions=(1.2, 1.5, 0.04),
            color=_TABLE_COLOUR,
            position=(0.35, 0.0, -0.02),
        )
        corners = task.outline
        corners[:, 2] = 0.002
        scene.add_line_segments(
            "/reach",
            points=np.stack([corners, np.roll(corners, -1, axis=0)], axis=1).astype(np.float32),
            colors=_REACH_COLOUR,
            thickness=0.004,
        )
        self._arrows: viser.ArrowsHandle | None = None
        self._props = PropsView(scene, poses, task.props)
        self._arm = RobotView(scene, poses, pack)
        self._ghost = GhostView(scene, poses, pack)
        self._hand = scene.add_icosphere(
            "/hand", radius=0.014, color=_HAND_COLOUR, cast_shadow=False
        )
        # A plumb line under the hand tells where over the table it is.
        scene.add_cylinder(
            "/hand/plumb",
            radius=0.0025,
            height=task.height_m,
            color=_HAND_COLOUR,
            cast_shadow=False,
            position=(0.0, 0.0, -task.height_m / 2),
        )
        self._foot = scene.add_cylinder(
            "/foot", radius=0.022, height=0.003, color=_HAND_COLOUR, cast_shadow=False
        )

    @property
    def viewers(self) -> int:
        """How many pages look at the scene now."""
        return self._server.viewers

    async def serve(self, socket: SceneSocket) -> None:
        """Show the scene to one page until it leaves."""
        await self._server.serve(socket)

    def show_arm(self, q: JointPositions, hand: Sequence[float] | np.ndarray) -> None:
        """Put the arm at ``q`` ``(7,)`` in [rad], with a mark under its hand ``(3,)`` in [m]."""
        self._arm.update(q)
        x, y, z = hand
        self._server.poses.put(self._hand, (x, y, z))
        self._server.poses.put(self._foot, (x, y, 0.003))
        self._server.poses.flush()

    def show_props(self, cup: HandState | None, beads: np.ndarray) -> None:
        """Put the cup and the beads ``(n, 3)`` in [m] where they are."""
        self._props.update(cup, beads)
        self._server.poses.flush()

    def show_move(self, end: JointPositions, hand_path: np.ndarray) -> None:
        """Show where a move ends, and the way ``(m, 3)`` of the hand in [m]."""
        with self._server.viser.atomic():
            self._ghost.show(end)
            if np.linalg.norm(hand_path[-1] - hand_path[0]) > _SEEN_WAY_M:
                self._show_way(hand_path.astype(np.float32))
            else:  # a turn on the spot: the ghost says it all
                self._server.viser.scene.remove_by_name("/move")
        self._server.flush()

    def _show_way(self, hand_path: np.ndarray) -> None:
        scene = self._server.viser.scene
        scene.add_spline_catmull_rom(
            "/move/way",
            points=hand_path,
            color=GHOST_COLOUR,
            thickness=_TRAIL_THICKNESS_M,
            thickness_units="world",
        )
        # The same move on the table, where the arm cannot hide it.
        on_table = hand_path[[0, -1]]
        on_table[:, 2] = 0.006
        scene.add_arrows(
            "/move/on_table",
            points=on_table[None],
            colors=GHOST_COLOUR,
            shaft_radius=0.008,
            head_radius=0.022,
            head_length=0.035,
        )

    def hide_move(self) -> None:
        """Take the ghost and its way out of the picture."""
        with self._server.viser.atomic():
            self._ghost.hide()
            self._server.viser.scene.remove_by_name("/move")
        self._server.flush()

    def show_arrows(self, points: np.ndarray) -> None:
        """Show where up, right, down and left would lead, ``(4, 2, 3)`` in [m]."""
        with self._server.viser.atomic():
            if self._arrows is None:
                self._arrows = self._server.viser.scene.add_arrows(
                    "/arrows",
                    points=points.astype(np.float32),
                    colors=np.array(ARROW_COLOURS, dtype=np.uint8),
                    shaft_radius=0.005,
                    head_radius=0.013,
                    head_length=0.026,
                )
            self._arrows.points = points.astype(np.float32)
            self._arrows.visible = True
        self._server.flush()

    def hide_arrows(self) -> None:
        """Take the arrows out of the picture."""
        if self._arrows is not None and self._arrows.visible:
            self._arrows.visible = False
            self._server.flush()

    def close(self) -> None:
        """Let every viewer go."""
        self._server.close()
