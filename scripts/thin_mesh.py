"""Removes what nobody can see from a mesh, and decimates its large parts, in Blender 3.4 of Debian 12:

    blender -b --python-exit-code 1 -P scripts/thin_mesh.py -- MESH.obj THIN.ply

A part is what hangs together. One edge collapse over all parts would thin small ones first, such as eyes, because its
error is weighted by area; so each part has triangles of its own.
"""

import math
import sys

import bmesh
import bpy
from mathutils import Vector
from mathutils.bvhtree import BVHTree

DIRECTIONS = 64  # from which a triangle may be seen
GRAZING = 0.05  # least cosine
SMALL_PART = 1000  # triangles of parts that stay as they are
LEAST, PER_AREA = 1500, 30000  # triangles of a large part


def spiral(count):
    """Directions spread evenly over the sphere (golden angle)."""
    for i in range(count):
        z, azimuth = 1 - (2 * i + 1) / count, i * math.pi * (3 - math.sqrt(5))
        radius = math.sqrt(1 - z * z)
        yield Vector((radius * math.cos(azimuth), radius * math.sin(azimuth), z))


def without_hidden(mesh):
    """Removes triangles that touch no visible triangle."""
    edited = bmesh.new()
    edited.from_mesh(mesh)
    bmesh.ops.triangulate(edited, faces=edited.faces)
    bmesh.ops.remove_doubles(edited, verts=edited.verts, dist=1e-6)
    tree = BVHTree.FromBMesh(edited)
    directions = list(spiral(DIRECTIONS))
    seen = set()
    for face in edited.faces:
        middle = face.calc_center_median()
        if any(d.dot(face.normal) > GRAZING and tree.ray_cast(middle + 1e-4 * d, d)[0] is None for d in directions):
            seen.update(vertex.index for vertex in face.verts)
    hidden = [face for face in edited.faces if not any(vertex.index in seen for vertex in face.verts)]
    bmesh.ops.delete(edited, geom=hidden, context="FACES")
    edited.to_mesh(mesh)


def decimate(part):
    count = len(part.data.polygons)
    wanted = LEAST + PER_AREA * sum(face.area for face in part.data.polygons)
    if count >= SMALL_PART and wanted < count:
        modifier = part.modifiers.new("decimate", "DECIMATE")
        modifier.ratio, modifier.use_collapse_triangulate = wanted / count, True


def main():
    source, target = sys.argv[sys.argv.index("--") + 1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=source, forward_axis="Y", up_axis="Z")
    whole = bpy.context.view_layer.objects.active = bpy.context.selected_objects[0]
    without_hidden(whole.data)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.separate(type="LOOSE")
    bpy.ops.object.mode_set(mode="OBJECT")
    for part in bpy.data.objects:
        decimate(part)
        part.select_set(True)
    bpy.ops.object.convert(target="MESH")  # applies the modifiers
    bpy.ops.object.join()
    bpy.ops.export_mesh.ply(filepath=target, use_ascii=True, use_selection=True, use_normals=False, use_uv_coords=False,
                            use_colors=False, axis_forward="Y", axis_up="Z")


main()
