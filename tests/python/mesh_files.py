"""Mesh files of small solids."""

import trimesh

import energymargin as em

# An L of two bars, 0.2 m long, 0.05 m wide and 0.04 m high.
OUTLINE = [(0, 0), (0.2, 0), (0.2, 0.05), (0.05, 0.05), (0.05, 0.2), (0, 0.2)]


def written(tmp_path, mesh, name="solid.stl"):
    mesh.export(tmp_path / name)
    return tmp_path / name


def bars():
    low = [(x, y, 0.0) for x, y in OUTLINE]
    high = [(x, y, 0.04) for x, y in OUTLINE]
    top = [(6, 6 + i, 7 + i) for i in (1, 2, 3, 4)]
    bottom = [(0, i + 1, i) for i in (1, 2, 3, 4)]
    around = [(i, (i + 1) % 6) for i in range(6)]
    sides = [face for a, b in around for face in ((a, b, a + 6), (b, b + 6, a + 6))]
    return trimesh.Trimesh(low + high, top + bottom + sides)


def angle(tmp_path, name="angle.stl"):
    return written(tmp_path, bars(), name)


def volume(compound):
    """That of the parts together."""
    return em.mass_properties(em.Compound(compound.parts)).volume


def has_inside(part, point):
    hull = trimesh.convex.convex_hull(part.shape.points)
    return bool(
        (hull.face_normals @ point <= (hull.face_normals * hull.triangles[:, 0]).sum(1)).all()
    )


def plate(tmp_path):
    """One of 100 mm, 20 mm thick, with a round hole of 42 mm."""
    hole = trimesh.creation.cylinder(0.021, 0.04, sections=64)
    return written(tmp_path, trimesh.creation.box((0.1, 0.1, 0.02)).difference(hole), "plate.stl")


def mug(tmp_path):
    """One of 80 mm, 100 mm high, that takes a cylinder of 70 mm to 10 mm above the table."""
    inner = trimesh.creation.cylinder(0.035, 0.1, sections=64)
    inner.apply_translation((0, 0, 0.01))
    cup = trimesh.creation.cylinder(0.04, 0.1, sections=64).difference(inner)
    return written(tmp_path, cup, "mug.stl")


def objects(*surfaces):
    """An OBJ file's text, with an object for each surface."""
    lines, start = [], 1
    for i, surface in enumerate(surfaces):
        lines += [f"o {i}", *(f"v {x} {y} {z}" for x, y, z in surface.vertices)]
        lines += ["f " + " ".join(str(int(v) + start) for v in face) for face in surface.faces]
        start += len(surface.vertices)
    return "\n".join(lines)
