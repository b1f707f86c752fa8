"""The arm's asset pack: the Panda's URDF, collision meshes and light pictures, in under 2 MB.

The meshes come from the package ``example-robot-data`` (Apache-2.0; 131 MB, of which the Panda is
11 MB). It is fetched once, at set-up, checked by its hash, and never installed: this module takes
the Panda out of the wheel and writes

======================  ==========================================================
``panda.urdf``          the arm with its hand; mesh paths relative to the file
``collision/*.stl``     convex hulls, for the physics
``visual/LINK.glb``     what a person sees: 15 % of the triangles, shaded smooth
``ghost.npz``           8 % of the triangles, one mesh a link: for the see-through arm
``LICENSE``, ``NOTICE``  the terms of the meshes, and what was changed
``manifest.json``       the hash of every file, and of the wheel they came from
======================  ==========================================================

Run ``python -m models.panda_pack --wheel FILE --out FOLDER`` (``make`` does).
"""

import argparse
import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .errors import PandaPackError
from .panda import LINK_NAMES

PACK_VERSION = 2
SOURCE = "example-robot-data 6.0.0"
# SHA-256 of the wheel as the package index serves it; requirements/panda.lock holds the same.
WHEEL_SHA256 = "424092a8093411ac2cd4ccc0572382bfc6b5eb4833aa984ef5e671dd67cd0a6e"
_WHEEL_FOLDER = "cmeel.prefix/share/example-robot-data/robots/panda_description/"
_PACKAGE_URL = "package://example-robot-data/robots/panda_description/"
_VISUAL_SHARE = 0.15  # of the triangles; indistinguishable on a screen (measured in screenshots)
_GHOST_SHARE = 0.08
_GHOST_INSET_M = 0.004
_SMOOTH_ANGLE_RAD = np.radians(35.0)


@dataclass(frozen=True)
class PandaPack:
    """Where the parts of a checked asset pack lie."""

    folder: Path

    @property
    def urdf(self) -> Path:
        """The arm with its hand."""
        return self.folder / "panda.urdf"

    def visual_glb(self, link: str) -> bytes:
        """What a person sees of one link, as binary glTF in the link's own frame."""
        return (self.folder / "visual" / f"{link}.glb").read_bytes()

    def ghost_mesh(self, link: str) -> tuple[np.ndarray, np.ndarray]:
        """One light mesh of a link: vertices ``(v, 3)`` in [m] and faces ``(f, 3)``."""
        with np.load(self.folder / "ghost.npz", allow_pickle=False) as meshes:
            return meshes[f"{link}.vertices"], meshes[f"{link}.faces"]


def default_folder() -> Path:
    """Where the pack lies: ``$JOYMAP_PANDA_DIR``, or ``data/panda`` beside the code."""
    root = Path(__file__).resolve().parents[1]
    return Path(os.environ.get("JOYMAP_PANDA_DIR", root / "data" / "panda"))


def open_pack(folder: Path | None = None) -> PandaPack:
    """Open the pack and check every file against the manifest.

    Raises:
        PandaPackError: If the pack is missing, of another version, or a file was changed.
    """
    folder = default_folder() if folder is None else folder
    manifest_path = folder / "manifest.json"
    if not manifest_path.is_file():
        raise PandaPackError(f"The arm's asset pack is not in {folder}; 'make setup' builds it.")
    manifest = json.loads(manifest_path.read_text())
    if manifest["version"] != PACK_VERSION:
        raise PandaPackError("The arm's asset pack is of another version; run 'make setup' again.")
    for name, digest in manifest["files"].items():
        path = folder / name
        if not path.is_file() or _sha256(path) != digest:
            raise PandaPackError(
                f"The arm's asset pack is damaged ({name}); delete {folder} and run 'make setup'."
            )
    return PandaPack(folder)


def build_pack(wheel: Path, folder: Path) -> PandaPack:
    """Build the pack from the wheel; the folder appears whole or not at all.

    Raises:
        PandaPackError: If the wheel is not the one this module was written for.
    """
    if _sha256(wheel) != WHEEL_SHA256:
        raise PandaPackError(f"{wheel.name} is not the wheel of {SOURCE} (its hash differs).")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        source, target = Path(scratch) / "source", Path(scratch) / "pack"
        _extract(wheel, source)
        (target / "visual").mkdir(parents=True)
        shutil.copytree(source / "meshes" / "collision", target / "collision")
        shutil.copy(source / "LICENSE", target / "LICENSE")
        (target / "NOTICE").write_text(
            f"Panda meshes and URDF from {SOURCE} (Apache-2.0, see LICENSE).\n"
            "Changed: mesh paths made relative; visual meshes merged per link, decimated and\n"
            "converted to binary glTF; ghost.npz derived from them.\n"
        )
        urdf = (source / "urdf" / "panda.urdf").read_text()
        _build_meshes(source, target)
        # The pictures go by the links' names; the file keeps what moves and what can be hit.
        urdf = re.sub(r"\s*<visual>.*?</visual>", "", urdf, flags=re.DOTALL)
        # Attributes outside the URDF standard, which parsers complain about one by one.
        urdf = re.sub(r'\s(D|K|mu_coulomb|mu_viscous)="[^"]*"', "", urdf)
        (target / "panda.urdf").write_text(
            urdf.replace(f"{_PACKAGE_URL}meshes/collision/", "collision/")
        )
        files = {
            path.relative_to(target).as_posix(): _sha256(path)
            for path in sorted(target.rglob("*"))
            if path.is_file()
        }
        manifest = {
            "version": PACK_VERSION,
            "source": SOURCE,
            "wheel_sha256": WHEEL_SHA256,
            "files": files,
        }
        (target / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n")
        if folder.exists():
            shutil.rmtree(folder)
        target.rename(folder)
    return open_pack(folder)


def _extract(wheel: Path, target: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            if name.startswith(_WHEEL_FOLDER) and not name.endswith("/"):
                path = target / name.removeprefix(_WHEEL_FOLDER)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(archive.read(name))


def _build_meshes(source: Path, target: Path) -> None:
    """Write one GLB a link, and the ghost's meshes."""
    import fast_simplification
    import trimesh
    import yourdfpy

    # Only the file's structure is wanted here; the meshes are loaded one link at a time below.
    urdf_path = source / "urdf" / "panda.urdf"
    robot = yourdfpy.URDF.load(
        str(urdf_path), build_scene_graph=False, load_meshes=False, mesh_dir=""
    )
    ghosts: dict[str, np.ndarray] = {}
    for link in LINK_NAMES:
        pieces: list[trimesh.Trimesh] = []
        ghost_pieces: list[trimesh.Trimesh] = []
        for visual in robot.link_map[link].visuals:
            path = source / visual.geometry.mesh.filename.removeprefix(_PACKAGE_URL)
            origin = np.eye(4) if visual.origin is None else visual.origin
            for piece in trimesh.load_scene(path).dump():
                piece.apply_transform(origin)
                colour = piece.visual.material.main_color
                plain = trimesh.Trimesh(piece.vertices, piece.faces)
                plain.merge_vertices()
                for share, bucket in ((_VISUAL_SHARE, pieces), (_GHOST_SHARE, ghost_pieces)):
                    vertices, faces = fast_simplification.simplify(
                        plain.vertices.astype(np.float32), plain.faces, 1.0 - share
                    )
                    light = trimesh.Trimesh(vertices, faces)
                    if bucket is pieces:
                        light = trimesh.graph.smooth_shade(light, angle=_SMOOTH_ANGLE_RAD)
                        light.visual = trimesh.visual.TextureVisuals(
                            material=trimesh.visual.material.PBRMaterial(
                                baseColorFactor=colour, metallicFactor=0.1, roughnessFactor=0.55
                            )
                        )
                        # Reading the normals makes the export write them.
                        _ = light.vertex_normals
                    bucket.append(light)
        scene = trimesh.Scene(pieces)
        (target / "visual" / f"{link}.glb").write_bytes(scene.export(file_type="glb"))
        ghost = trimesh.util.concatenate(ghost_pieces)
        # Drawn where the arm itself is, the ghost would flicker through it: it is a little thinner.
        inset = ghost.vertices - _GHOST_INSET_M * ghost.vertex_normals
        ghosts[f"{link}.vertices"] = inset.astype(np.float32)
        ghosts[f"{link}.faces"] = ghost.faces.astype(np.uint32)
        print(f"  {link}: {sum(len(p.faces) for p in pieces)} triangles", flush=True)  # noqa: T201
    np.savez_compressed(target / "ghost.npz", allow_pickle=False, **ghosts)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def main() -> int:
    """Build the pack unless it is already there and whole."""
    parser = argparse.ArgumentParser(description="Build the arm's asset pack.")
    parser.add_argument("--wheel", type=Path, help="the wheel of " + SOURCE)
    parser.add_argument("--out", type=Path, default=default_folder())
    parser.add_argument("--check", action="store_true", help="only check; exit 1 if not there")
    arguments = parser.parse_args()
    try:
        if arguments.check:
            open_pack(arguments.out)
        elif arguments.wheel is None:
            parser.error("--wheel is needed to build the pack")
        else:
            build_pack(arguments.wheel, arguments.out)
    except PandaPackError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
