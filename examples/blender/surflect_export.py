"""Exports a Blender scene to Surflect: a capture, rendered by Cycles under one lamp at a time, and a film script.

    blender scene.blend -b -P surflect_export.py -- FOLDER [--help]
    blender scene.blend -b -P surflect_export.py -- --camera-path camera.json

or as an add-on (Edit > Preferences > Add-ons > Install): File > Export > Surflect capture, or Surflect camera path.
Blender 3.4 and newer. FOLDER must not exist, or be empty. docs/import.md, "Blender", says what is exported.
"""

bl_info = {"name": "Surflect capture", "author": "Surflect", "version": (1, 0, 0), "blender": (3, 4, 0),
           "location": "File > Export > Surflect capture", "category": "Import-Export",
           "description": "Photographs under one lamp at a time, mesh and film script"}

import argparse
import contextlib
import dataclasses
import json
import math
import os
import shutil
import struct
import sys
import tempfile

import bpy
import mathutils

RIG = "Capture"  # collection of the cameras and lamps that photograph the object
MOST_MOVING = 20000  # vertices of a mesh whose motion becomes a warp


class ExportError(Exception):
    """One line: what was found, and what was expected."""


@dataclasses.dataclass
class Options:
    width: int = 512
    height: int = 512
    samples: int = 64
    cameras: int = 40  # of the dome, where the scene has no cameras for a capture
    lamps: int = 8
    objects: tuple = ()  # names; empty: all meshes that are rendered


# ------------------------------------------------------------------------------------------------------------------
# Objects.

def rendered(scene, kind):
    return [thing for thing in scene.objects if thing.type in kind and not thing.hide_render and
            not any(c.hide_render for c in thing.users_collection)]


SOLID = ("MESH", "CURVE", "SURFACE", "META", "FONT")


def subjects(scene, options):
    """Objects that are photographed, and others that are there but not seen."""
    solids = rendered(scene, SOLID)
    known = {thing.name for thing in solids}
    for name in options.objects:
        if name not in known:
            raise ExportError(f"--objects: found {name!r}, expected one of {', '.join(sorted(known)) or 'none'}")
    chosen = [thing for thing in solids if not options.objects or thing.name in options.objects]
    if not chosen:
        raise ExportError("scene: found no mesh that is rendered, expected one or more")
    return chosen, [thing for thing in solids if thing not in chosen]


def world_mesh(objects):
    """Vertices and triangles of all objects with their modifiers, in the world."""
    graph = bpy.context.evaluated_depsgraph_get()
    vertices, triangles = [], []
    for thing in objects:
        evaluated = thing.evaluated_get(graph)
        mesh = evaluated.to_mesh()
        mesh.calc_loop_triangles()
        first = len(vertices)
        vertices += [tuple(evaluated.matrix_world @ vertex.co) for vertex in mesh.vertices]
        flip = evaluated.matrix_world.determinant() < 0  # a mirrored object shows its other side
        for triangle in mesh.loop_triangles:
            corners = [first + corner for corner in triangle.vertices]
            triangles.append(tuple(reversed(corners) if flip else corners))
        evaluated.to_mesh_clear()
    return vertices, triangles


def write_ply(path, vertices, triangles):
    header = ("ply\nformat binary_little_endian 1.0\n"
              f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    with open(path, "wb") as file:
        file.write(header.encode())
        file.writelines(struct.pack("<3f", *vertex) for vertex in vertices)
        file.writelines(struct.pack("<B3i", 3, *triangle) for triangle in triangles)


def sphere_around(vertices):
    low, high = ([choose(vertex[axis] for vertex in vertices) for axis in range(3)] for choose in (min, max))
    middle = mathutils.Vector([(a + b) / 2 for a, b in zip(low, high)])
    return middle, max((mathutils.Vector(vertex) - middle).length for vertex in vertices)


# ------------------------------------------------------------------------------------------------------------------
# Cameras and lamps.

def clean(name):
    return bpy.path.clean_name(name)


def lens_of(camera, width, height):
    """Focal length and principal point in pixels: the sensor's side that fits the picture has `fitted` pixels."""
    data = camera.data
    if data.type != "PERSP":
        raise ExportError(f"camera {camera.name!r}: found type {data.type}, expected PERSP")
    fit = data.sensor_fit if data.sensor_fit != "AUTO" else ("HORIZONTAL" if width >= height else "VERTICAL")
    fitted = width if fit == "HORIZONTAL" else height
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    focal = data.lens / sensor * fitted
    return {"fl_x": focal, "fl_y": focal, "cx": width / 2 - data.shift_x * fitted, "cy": height / 2 + data.shift_y * fitted}


def rigid(matrix):
    """The same place and axes without scale."""
    place, turn, _ = matrix.decompose()
    return mathutils.Matrix.Translation(place) @ turn.to_matrix().to_4x4()


def strength_of(lamp):
    """W/sr of a point lamp, whose power is spread over all directions; W/m^2 of a sun that faces the surface."""
    data = lamp.data
    if data.type not in ("POINT", "SUN"):
        raise ExportError(f"lamp {lamp.name!r}: found type {data.type}, expected POINT or SUN (or exclude it from rendering)")
    if data.use_nodes and data.node_tree and any(node.type == "EMISSION" and (node.inputs["Strength"].is_linked or node.inputs["Color"].is_linked
                                                           or node.inputs["Strength"].default_value != 1)
                              for node in data.node_tree.nodes):
        raise ExportError(f"lamp {lamp.name!r}: found nodes that change its light, expected none")
    color = mathutils.Vector(data.color)
    if getattr(data, "use_temperature", False):
        color = mathutils.Vector(a * b for a, b in zip(color, data.temperature_color))
    power = data.energy * 2 ** getattr(data, "exposure", 0)
    return list(color * (power / (4 * math.pi) if data.type == "POINT" else power))


def light_of(lamp):
    """The lamp as a light of transforms.json."""
    strength = strength_of(lamp)
    if min(strength) <= 0:
        raise ExportError(f"lamp {lamp.name!r}: found the strength {strength}, expected each colour above 0")
    if lamp.data.type == "POINT":
        return {"name": clean(lamp.name), "type": "point", "position": list(lamp.matrix_world.translation), "intensity": strength}
    towards = rigid(lamp.matrix_world).to_3x3() @ mathutils.Vector((0, 0, 1))
    return {"name": clean(lamp.name), "type": "directional", "direction": list(towards.normalized()), "irradiance": strength}


def spiral(index, count, low, high):
    """Unit directions at equal areas between two elevations, in degrees."""
    a, b = (math.sin(math.radians(x)) for x in (low, high))
    z = a + (b - a) * (index + 0.5) / count
    azimuth = index * math.pi * (3 - math.sqrt(5))
    return mathutils.Vector((math.sqrt(1 - z * z) * math.cos(azimuth), math.sqrt(1 - z * z) * math.sin(azimuth), z))


def dome(scene, vertices, has_others, options):
    """Cameras and suns around the object; above it alone if it stands on something."""
    middle, radius = sphere_around(vertices)
    lowest = 5 if has_others else -60
    cameras, lamps = [], []
    for i in range(options.cameras):
        data = bpy.data.cameras.new(f"dome_{i:02d}")
        data.sensor_fit, data.angle = "AUTO", math.radians(30)
        away = spiral(i, options.cameras, lowest, 85)
        distance = 1.05 * radius / math.sin(math.radians(15))
        if options.width != options.height:  # the angle is that of the longer side
            distance *= max(options.width, options.height) / min(options.width, options.height)
        data.clip_start, data.clip_end = distance / 1000, 10 * distance
        camera = bpy.data.objects.new(data.name, data)
        camera.matrix_world = mathutils.Matrix.Translation(middle + distance * away) @ away.to_track_quat("Z", "Y").to_matrix().to_4x4()
        cameras.append(camera)
    for i in range(options.lamps):
        data = bpy.data.lights.new(f"sun_{i:02d}", "SUN")
        data.energy = 3
        lamp = bpy.data.objects.new(data.name, data)
        lamp.matrix_world = spiral(i, options.lamps, 10 if has_others else -40, 85).to_track_quat("Z", "Y").to_matrix().to_4x4()
        lamps.append(lamp)
    for thing in cameras + lamps:
        scene.collection.objects.link(thing)
    return cameras, lamps


def in_rig(thing):
    return any(collection.name == RIG for collection in thing.users_collection)


def split_rig(scene):
    """Cameras and lamps of the capture, which may be none, and lamps of the film."""
    cameras, lamps = rendered(scene, ("CAMERA",)), rendered(scene, ("LIGHT",))
    if any(in_rig(camera) for camera in cameras):
        film = [lamp for lamp in lamps if not in_rig(lamp)]
        return [camera for camera in cameras if in_rig(camera)], [lamp for lamp in lamps if in_rig(lamp)] or lamps, film
    return [camera for camera in cameras if camera != scene.camera], lamps, lamps


# ------------------------------------------------------------------------------------------------------------------
# The film.

def keyframes(frames, values):
    """A literal, or as few [frame, value] as reproduce all values linearly to 1e-5 of their range."""
    tolerance = 1e-5 * (max(values) - min(values))
    if max(values) - min(values) <= 1e-7 * max(1, max(map(abs, values))):
        return f"{values[0]:.7g}"
    kept, ranges = {0, len(frames) - 1}, [(0, len(frames) - 1)]
    while ranges:
        a, b = ranges.pop()
        error, where = max(((abs(values[a] + (values[b] - values[a]) * (frames[i] - frames[a]) / (frames[b] - frames[a]) - values[i]), i)
                            for i in range(a + 1, b)), default=(0, a))
        if error > tolerance:
            kept.add(where)
            ranges += [(a, where), (where, b)]
    return "[" + ", ".join(f"[{frames[i]}, {values[i]:.7g}]" for i in sorted(kept)) + "]"


def track(frames, rows):
    """Keyframes of each component of a vector."""
    return "[" + ", ".join(keyframes(frames, [row[i] for row in rows]) for i in range(len(rows[0]))) + "]"


def film_of(scene, lamps, objects, folder, say):
    """Text of the script; also writes the meshes of a moving object. None without a camera."""
    if scene.camera is None:
        say("the scene has no active camera: no film is written")
        return None
    first, last = scene.frame_start, scene.frame_end
    if first < 0:
        raise ExportError(f"scene: found the first frame {first}, expected 0 or more")
    width, height = film_size(scene)
    frames = list(range(first, last + 1))
    usable = []
    for lamp in lamps:
        try:
            strength_of(lamp)
            usable.append(lamp)
        except ExportError as problem:
            say(f"left out of the film: {problem}")
    before = scene.frame_current
    scene.frame_set(before)
    rest, triangles = world_mesh(objects)
    camera_rows, lamp_rows, meshes = [], [[] for _ in usable], []
    for frame in frames:
        scene.frame_set(frame)
        camera = scene.camera
        lens = lens_of(camera, width, height)
        if abs(lens["cx"] - width / 2) + abs(lens["cy"] - height / 2) > 1e-3:
            raise ExportError(f"camera {camera.name!r}: found a lens shift at frame {frame}, expected none in a film")
        pose = rigid(camera.matrix_world)
        place, axes = pose.translation, pose.to_3x3()
        ahead = place - axes.col[2]
        camera_rows.append([*place, *ahead, *axes.col[1], math.degrees(2 * math.atan(height / 2 / lens["fl_y"]))])
        for rows, lamp in zip(lamp_rows, usable):
            strength = [0, 0, 0] if lamp.hide_render else strength_of(lamp)
            matrix = rigid(lamp.matrix_world)
            rows.append([*(matrix.translation if lamp.data.type == "POINT" else matrix.to_3x3().col[2]), *strength])
        meshes.append(world_mesh(objects)[0])
    scene.frame_set(before)

    lines = ["# Written from a Blender scene. surflect pack capture -o capture.srf; surflect render film.toml -o frames",
             'model = "capture.srf"', "[frames]", f"first = {first}\nlast = {last}\nfps = {scene.render.fps / scene.render.fps_base:.7g}",
             "[output]", f"size = [{width}, {height}]", 'path = "frame.####.exr"', "png = true", "[camera]"]
    for key, columns in (("position", slice(0, 3)), ("look_at", slice(3, 6)), ("up", slice(6, 9))):
        lines.append(f"{key} = {track(frames, [row[columns] for row in camera_rows])}")
    lines.append(f"fov_deg = {keyframes(frames, [row[9] for row in camera_rows])}")
    for lamp, rows in zip(usable, lamp_rows):
        kind, key = ("point", "position") if lamp.data.type == "POINT" else ("directional", "direction")
        lines += ["[[light]]", f'type = "{kind}"  # {clean(lamp.name)}', f"{key} = {track(frames, [row[:3] for row in rows])}",
                  f"color = {track(frames, [row[3:] for row in rows])}"]

    size = max(sphere_around(rest)[1], 1e-9)
    if any(len(mesh) != len(rest) for mesh in meshes):
        say("the number of vertices changes over the film, so that the object stands still in it")
    elif any(math.dist(a, b) > 1e-5 * size for mesh in meshes for a, b in zip(mesh, rest)):
        if len(rest) > MOST_MOVING:
            say(f"the object moves, but has {len(rest)} vertices, more than {MOST_MOVING}: it stands still in the film; "
                "bend it by a cage (docs/script.md, mesh)")
        else:
            os.mkdir(os.path.join(folder, "moving"))
            for name, mesh in [("rest.obj", rest)] + [(f"at.{frame:05d}.obj", mesh) for frame, mesh in zip(frames, meshes)]:
                with open(os.path.join(folder, "moving", name), "w") as file:
                    file.writelines("v {:.7g} {:.7g} {:.7g}\n".format(*vertex) for vertex in mesh)
                    file.writelines("f {} {} {}\n".format(*(corner + 1 for corner in triangle)) for triangle in triangles)
            lines += ["[[warp]]", 'type = "mesh"', 'rest = "moving/rest.obj"', 'frames = "moving/at.#####.obj"']
    return "\n".join(lines) + "\n"


# ------------------------------------------------------------------------------------------------------------------
# A camera path, for [camera] file = "camera.json" of a script.

def film_size(scene):
    """Width and height of the scene's pictures."""
    if scene.render.pixel_aspect_x != scene.render.pixel_aspect_y:
        raise ExportError("scene: found pixels that are not square, expected equal aspects")
    return tuple(round(x * scene.render.resolution_percentage / 100) for x in (scene.render.resolution_x, scene.render.resolution_y))


def camera_path(scene):
    """The active camera at each frame: camera-to-world matrix, x right, y up, z backwards; lens in pixels."""
    if scene.camera is None:
        raise ExportError("scene: found no active camera, expected one")
    width, height = film_size(scene)
    before, subframe, keys = scene.frame_current, scene.frame_subframe, []
    try:
        for frame in range(scene.frame_start, scene.frame_end + 1):
            scene.frame_set(frame)
            keys.append({"frame": frame, **lens_of(scene.camera, width, height),
                         "transform_matrix": [list(row) for row in rigid(scene.camera.matrix_world)]})
    finally:
        scene.frame_set(before, subframe=subframe)
    return {"w": width, "h": height, "frames": keys}


def export_camera_path(scene, path, say):
    """Writes the path; the file appears when it is complete."""
    keys = camera_path(scene)
    cuts = sorted({marker.frame for marker in scene.timeline_markers
                   if marker.camera and scene.frame_start < marker.frame <= scene.frame_end})
    if cuts:
        say(f"markers change the camera at frames {', '.join(map(str, cuts))}: whole frames show each cut, but motion blur, "
            "and frames between, sweep from one camera to the other")
    path = os.path.abspath(path)
    with tempfile.NamedTemporaryFile("w", dir=os.path.dirname(path), prefix=os.path.basename(path) + ".", delete=False) as file:
        try:
            json.dump(keys, file, indent=1)
            file.close()
            os.chmod(file.name, 0o644)
            os.replace(file.name, path)
        except BaseException:
            os.unlink(file.name)
            raise
    say(f'{path}: {len(keys["frames"])} frames. In a script: [camera] file = "{os.path.basename(path)}", '
        f'and size = [{keys["w"]}, {keys["h"]}]')


# ------------------------------------------------------------------------------------------------------------------
# Photographs.

@contextlib.contextmanager
def changed(*settings):
    """Sets attributes, (thing, name, value) each, and restores them."""
    before = []
    try:
        for thing, name, value in settings:
            before.append((thing, name, getattr(thing, name)))
            setattr(thing, name, value)
        yield
    finally:
        for thing, name, value in reversed(before):
            setattr(thing, name, value)


def glowing(objects):
    """Names of materials that emit light, which would be in every photograph."""
    names = set()
    for slot in (slot for thing in objects for slot in thing.material_slots if slot.material and slot.material.node_tree):
        for node in slot.material.node_tree.nodes:
            color = node.inputs.get("Emission Color") or node.inputs.get("Emission")
            strength = node.inputs.get("Emission Strength")
            if node.type == "EMISSION" or (node.type == "BSDF_PRINCIPLED" and (
                    color.is_linked or max(color.default_value[:3]) > 0) and (strength.is_linked or strength.default_value > 0)):
                names.add(slot.material.name)
    return sorted(names)


def render_capture(scene, folder, cameras, lamps, seen, unseen, options, say):
    render, cycles = scene.render, scene.cycles
    all_lamps = [thing for thing in scene.objects if thing.type == "LIGHT"]
    settings = [(render, "engine", "CYCLES"), (render, "film_transparent", True), (render, "resolution_x", options.width),
                (render, "resolution_y", options.height), (render, "resolution_percentage", 100), (render, "pixel_aspect_x", 1),
                (render, "pixel_aspect_y", 1), (render, "use_border", False), (render, "use_compositing", False),
                (render, "use_sequencer", False), (render, "use_motion_blur", False), (render, "use_persistent_data", True),
                (render, "filepath", ""), (render.image_settings, "file_format", "OPEN_EXR"),
                (render.image_settings, "color_mode", "RGBA"), (render.image_settings, "color_depth", "16"),
                (cycles, "samples", options.samples), (cycles, "use_denoising", False), (cycles, "film_exposure", 1),
                (scene, "world", None), (scene, "camera", cameras[0])]
    settings += [(lamp, "hide_render", True) for lamp in all_lamps] + [(lamp, "visible_camera", False) for lamp in all_lamps]
    settings += [(thing, "visible_camera", False) for thing in unseen]
    settings += [(marker, "camera", None) for marker in scene.timeline_markers]  # else they choose the camera
    settings += [(camera.data.dof, "use_dof", False) for camera in cameras]
    done = 0
    with changed(*settings):
        scene.frame_set(scene.frame_current)
        for lamp in (lamp for lamp in all_lamps if not lamp.hide_render):
            raise ExportError(f"lamp {lamp.name!r}: found animated visibility in renders, expected one that stays")
        for camera in cameras:
            scene.camera = camera
            for lamp in lamps:
                render.filepath = os.path.join(folder, "images", clean(camera.name), clean(lamp.name) + ".exr")
                with changed((lamp, "hide_render", False)):
                    bpy.ops.render.render(write_still=True)
                done += 1
                say(f"photograph {done} of {len(cameras) * len(lamps)}")


def export(scene, folder, options, say):
    """Writes FOLDER/capture and FOLDER/film.toml; the folder appears when both are complete."""
    folder = os.path.abspath(folder)
    if os.path.exists(folder) and (not os.path.isdir(folder) or os.listdir(folder)):
        raise ExportError(f"{folder}: found something there, expected a new or empty folder")
    seen, unseen = subjects(scene, options)
    bpy.context.view_layer.update()
    vertices, triangles = world_mesh(seen)
    if not triangles:
        raise ExportError("scene: found no faces, expected a surface")
    cameras, lamps, film_lamps = split_rig(scene)
    made, partial = [], None
    try:
        if not cameras:
            cameras, lamps = dome(scene, vertices, bool(unseen), options)
            made = cameras + lamps
            say(f"no cameras beside the film's: a dome of {len(cameras)} cameras and {len(lamps)} suns takes the photographs")
            bpy.context.view_layer.update()
        if not lamps:
            raise ExportError("scene: found no lamp that is rendered, expected one or more")
        for kind, things in (("camera", cameras), ("lamp", lamps)):
            names = [clean(thing.name) for thing in things]
            if len(set(names)) < len(names):
                raise ExportError(f"{kind}s: found names that are equal as file names, expected different ones")
        lights = [light_of(lamp) for lamp in lamps]
        frames = []
        for camera in cameras:
            lens = lens_of(camera, options.width, options.height)
            matrix = [list(row) for row in rigid(camera.matrix_world)]
            for light in lights:
                frames.append({"file_path": f"images/{clean(camera.name)}/{light['name']}.exr", "camera": clean(camera.name),
                               "light": light["name"], **lens, "transform_matrix": matrix})
        for thing in scene.objects:
            if thing.instance_type != "NONE" and not thing.hide_render:
                say(f"warning: {thing.name!r} has instances, which are photographed but not in the mesh: make them real")
        for name in glowing(seen + unseen):
            say(f"warning: material {name!r} emits light, which is in every photograph")
        partial = tempfile.mkdtemp(prefix=os.path.basename(folder) + ".", dir=os.path.dirname(folder))
        os.mkdir(os.path.join(partial, "capture"))
        film = film_of(scene, film_lamps, seen, partial, say)
        if film is not None:
            with open(os.path.join(partial, "film.toml"), "w") as file:
                file.write(film)
        write_ply(os.path.join(partial, "capture", "mesh.ply"), vertices, triangles)
        with open(os.path.join(partial, "capture", "transforms.json"), "w") as file:
            json.dump({"w": options.width, "h": options.height, "color_space": "linear", "geometry": "mesh.ply",
                       "lights": lights, "frames": frames}, file, indent=1)
        render_capture(scene, os.path.join(partial, "capture"), cameras, lamps, seen, unseen, options, say)
        if os.path.isdir(folder):
            os.rmdir(folder)
        os.chmod(partial, 0o755)
        os.rename(partial, folder)
        partial = None
    finally:
        if partial is not None:
            shutil.rmtree(partial, ignore_errors=True)
        for thing in made:
            data = thing.data
            bpy.data.objects.remove(thing)
            (bpy.data.cameras if isinstance(data, bpy.types.Camera) else bpy.data.lights).remove(data)
    say(f"{folder}: {len(cameras)} cameras, {len(lamps)} lamps. Next: surflect pack {folder}/capture -o {folder}/capture.srf")


# ------------------------------------------------------------------------------------------------------------------
# Command line, and add-on.

def main(arguments):
    parser = argparse.ArgumentParser(prog="blender SCENE.blend -b -P surflect_export.py --", description=__doc__.split("\n")[0])
    parser.add_argument("folder", nargs="?", help="new or empty")
    parser.add_argument("--camera-path", metavar="FILE", help="only the path of the active camera, for [camera] file")
    parser.add_argument("--size", nargs=2, type=int, metavar=("WIDTH", "HEIGHT"), default=(512, 512), help="of a photograph")
    parser.add_argument("--samples", type=int, default=Options.samples, help="of a pixel")
    parser.add_argument("--cameras", type=int, default=Options.cameras, help="of the dome, where the scene has none of its own")
    parser.add_argument("--lamps", type=int, default=Options.lamps, help="of the dome")
    parser.add_argument("--objects", nargs="+", default=(), metavar="NAME", help="photographed alone; default: all meshes")
    given = parser.parse_args(arguments)
    if min(*given.size, given.samples, given.cameras, given.lamps) < 1:
        parser.error("numbers must be 1 or more")
    if (given.folder is None) == (given.camera_path is None):
        parser.error("expected either a folder or --camera-path FILE")

    def say(text):
        print(text, flush=True)

    try:
        if given.camera_path:
            export_camera_path(bpy.context.scene, given.camera_path, say)
        else:
            export(bpy.context.scene, given.folder, Options(*given.size, given.samples, given.cameras, given.lamps, tuple(given.objects)), say)
    except (ExportError, OSError, RuntimeError) as problem:
        print(f"error: {str(problem).strip()}", file=sys.stderr)
        sys.exit(1)


class EXPORT_OT_surflect(bpy.types.Operator):
    """Photographs under one lamp at a time by Cycles, mesh and film script; takes as long as so many renders"""
    bl_idname = "export_scene.surflect"
    bl_label = "Export Surflect capture"

    directory: bpy.props.StringProperty(subtype="DIR_PATH")
    name: bpy.props.StringProperty(name="Folder", default="surflect")
    width: bpy.props.IntProperty(name="Width", default=Options.width, min=1)
    height: bpy.props.IntProperty(name="Height", default=Options.height, min=1)
    samples: bpy.props.IntProperty(name="Samples", default=Options.samples, min=1)
    cameras: bpy.props.IntProperty(name="Cameras of the dome", default=Options.cameras, min=1)
    lamps: bpy.props.IntProperty(name="Suns of the dome", default=Options.lamps, min=1)
    selected: bpy.props.BoolProperty(name="Selected objects alone", default=False)

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        names = tuple(thing.name for thing in context.selected_objects if thing.type in SOLID) if self.selected else ()
        try:
            export(context.scene, os.path.join(self.directory, self.name),
                   Options(self.width, self.height, self.samples, self.cameras, self.lamps, names),
                   lambda text: self.report({"INFO"}, text))
        except (ExportError, OSError, RuntimeError) as problem:
            self.report({"ERROR"}, str(problem).strip())
            return {"CANCELLED"}
        return {"FINISHED"}


class EXPORT_OT_surflect_camera(bpy.types.Operator):
    """Pose and lens of the active camera at each frame, for [camera] file in a film script"""
    bl_idname = "export_scene.surflect_camera"
    bl_label = "Export Surflect camera path"

    filepath: bpy.props.StringProperty(subtype="FILE_PATH", default="camera.json")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            export_camera_path(context.scene, self.filepath, lambda text: self.report({"INFO"}, text))
        except (ExportError, OSError) as problem:
            self.report({"ERROR"}, str(problem).strip())
            return {"CANCELLED"}
        return {"FINISHED"}


OPERATORS = (EXPORT_OT_surflect, EXPORT_OT_surflect_camera)


def menu(self, context):
    self.layout.operator(EXPORT_OT_surflect.bl_idname, text="Surflect capture")
    self.layout.operator(EXPORT_OT_surflect_camera.bl_idname, text="Surflect camera path")


def register():
    for operator in OPERATORS:
        bpy.utils.register_class(operator)
    bpy.types.TOPBAR_MT_file_export.append(menu)


def unregister():
    bpy.types.TOPBAR_MT_file_export.remove(menu)
    for operator in reversed(OPERATORS):
        bpy.utils.unregister_class(operator)


if __name__ == "__main__":
    if bpy.app.background and "--" in sys.argv:
        main(sys.argv[sys.argv.index("--") + 1:])
    else:
        register()
