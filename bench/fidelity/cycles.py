"""Renders one neutral benchmark scene (of make_scenes.py) with Cycles, headless, at several sample counts.

  blender -b --factory-startup --python cycles.py -- SCENE.json OUTDIR --spp 1,16,256 [--seed 0]
          [--adaptive THRESHOLD] [--threads 2] [--tag NAME] [--size N] [--step-rate R] [--pattern SOBOL]

Writes OUTDIR/<scene>_<tag>_<spp>.pfm (linear RGB float) and appends one JSON line per render to OUTDIR/times.jsonl:
wall seconds of the render operator (scene sync and BVH build included).
"""
import argparse, json, math, os, sys, time
import bpy, numpy as np
from mathutils import Matrix, Vector

ap = argparse.ArgumentParser()
ap.add_argument('scene'); ap.add_argument('out')
ap.add_argument('--spp', default='16'); ap.add_argument('--seed', type=int, default=0)
ap.add_argument('--adaptive', type=float, default=0); ap.add_argument('--threads', type=int, default=2)
ap.add_argument('--tag', default='cycles'); ap.add_argument('--size', type=int, default=0)
ap.add_argument('--step-rate', type=float, default=0.25); ap.add_argument('--pattern', default='SOBOL')
ap.add_argument('--depth', type=int, default=0, help='override max_scatter_events')
ap.add_argument('--save-exr', default='', help='also save the last render as half-float EXR')
A = ap.parse_args(sys.argv[sys.argv.index('--') + 1:])
S = json.load(open(A.scene)); base = os.path.dirname(os.path.abspath(A.scene))
os.makedirs(A.out, exist_ok=True)

bpy.ops.wm.read_factory_settings(use_empty=True)
sc = bpy.context.scene
sc.render.engine = 'CYCLES'


def nodes_of(mat):
    mat.use_nodes = True
    nt = mat.node_tree
    nt.nodes.clear()
    return nt, nt.nodes.new('ShaderNodeOutputMaterial')


def emission(nt, c):
    e = nt.nodes.new('ShaderNodeEmission')
    k = max(c)
    e.inputs['Color'].default_value = [q / k for q in c] + [1]
    e.inputs['Strength'].default_value = k
    return e.outputs[0]


def closure(nt, m):
    t = m['type']
    if t == 'lambert':
        n = nt.nodes.new('ShaderNodeBsdfDiffuse')
        n.inputs['Color'].default_value = m['albedo'] + [1]
    elif t == 'emitter':
        return emission(nt, m['radiance'])
    elif t == 'ggx_conductor':
        n = nt.nodes.new('ShaderNodeBsdfGlossy')
        n.distribution = 'GGX'
        n.inputs['Roughness'].default_value = math.sqrt(m['alpha'])     # Cycles squares its roughness
        n.inputs['Color'].default_value = m['colour'] + [1]
    elif t == 'smooth_dielectric':
        n = nt.nodes.new('ShaderNodeBsdfGlass')
        n.distribution = 'SHARP'
        n.inputs['Roughness'].default_value = 0
        n.inputs['IOR'].default_value = m['ior']
        n.inputs['Color'].default_value = m['colour'] + [1]
    elif t == 'mix':
        n = nt.nodes.new('ShaderNodeMixShader')
        n.inputs[0].default_value = m['weight_b']
        nt.links.new(closure(nt, m['a']), n.inputs[1])
        nt.links.new(closure(nt, m['b']), n.inputs[2])
    else:
        raise SystemExit('unknown material ' + t)
    return n.outputs[0]


mats = {}
for name, m in S['materials'].items():
    b = bpy.data.materials.new(name)
    nt, out = nodes_of(b)
    nt.links.new(closure(nt, m), out.inputs['Surface'])
    mats[name] = b


def load_obj(path):
    """-> vertices (n,3), list of polygons, material index per polygon, material names"""
    v, f, mi, names, cur = [], [], [], [], 0
    for line in open(path):
        if line[:2] == 'v ':
            v.append(tuple(map(float, line.split()[1:4])))
        elif line[:2] == 'f ':
            f.append([int(k.split('/')[0]) - 1 for k in line.split()[1:]])
            mi.append(cur)
        elif line.startswith('usemtl'):
            n = line.split()[1]
            if n not in names:
                names.append(n)
            cur = names.index(n)
    return v, f, mi, names


def link(name, me):
    ob = bpy.data.objects.new(name, me)
    sc.collection.objects.link(ob)
    return ob


for i, o in enumerate(S['objects']):
    if o['type'] == 'mesh':
        v, f, mi, names = load_obj(os.path.join(base, o['file']))
        # one Blender mesh per material, so that an emitter is its own object
        f = [tuple(p) for p in f]
        for k, n in enumerate(names):
            sub = [p for p, q in zip(f, mi) if q == k]
            used = sorted({a for p in sub for a in p})
            re = dict(zip(used, range(len(used))))
            me = bpy.data.meshes.new('%d_%s' % (i, n))
            me.from_pydata([v[a] for a in used], [], [tuple(re[a] for a in p) for p in sub])
            me.materials.append(mats[n])
            link(me.name, me)
    elif o['type'] == 'sphere':
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=7, radius=o['radius'], location=o['centre'])
        ob = bpy.context.object
        ob.data.materials.append(mats[o['material']])
        ob.data.polygons.foreach_set('use_smooth', [True] * len(ob.data.polygons))

for vol in S.get('volumes', []):
    lo, hi = vol['min'], vol['max']
    p = [(x, y, z) for z in (lo[2], hi[2]) for y in (lo[1], hi[1]) for x in (lo[0], hi[0])]
    me = bpy.data.meshes.new('volume')
    me.from_pydata(p, [], [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    m = bpy.data.materials.new('volume')
    nt, out = nodes_of(m)
    s, a, add = (nt.nodes.new(k) for k in ('ShaderNodeVolumeScatter', 'ShaderNodeVolumeAbsorption', 'ShaderNodeAddShader'))
    s.inputs['Color'].default_value = (1, 1, 1, 1); s.inputs['Density'].default_value = vol['sigma_s']
    a.inputs['Color'].default_value = (0, 0, 0, 1); a.inputs['Density'].default_value = vol['sigma_a']
    if not vol['density'].startswith('1 '):     # the smoke ball of gen_scenes.py, as math nodes
        def math_node(op, *ins):
            n = nt.nodes.new('ShaderNodeMath'); n.operation = op
            for k, x in enumerate(ins):
                if isinstance(x, (int, float)):
                    n.inputs[k].default_value = x
                else:
                    nt.links.new(x, n.inputs[k])
            return n.outputs[0]
        geo = nt.nodes.new('ShaderNodeNewGeometry').outputs['Position']
        sep = nt.nodes.new('ShaderNodeSeparateXYZ'); nt.links.new(geo, sep.inputs[0])
        d = nt.nodes.new('ShaderNodeVectorMath'); d.operation = 'DISTANCE'
        nt.links.new(geo, d.inputs[0]); d.inputs[1].default_value = (0, 0.95, 0)
        fall = math_node('MAXIMUM', math_node('SUBTRACT', 1, math_node('DIVIDE', d.outputs['Value'], 0.85)), 0)
        sn = [math_node('SINE', math_node('MULTIPLY', q, 9)) for q in sep.outputs]
        prod = math_node('MULTIPLY', math_node('MULTIPLY', sn[0], sn[1]), sn[2])
        dens = math_node('MULTIPLY', fall, math_node('ADD', math_node('MULTIPLY', prod, 0.5), 0.5))
        nt.links.new(math_node('MULTIPLY', dens, vol['sigma_s']), s.inputs['Density'])
        nt.links.new(math_node('MULTIPLY', dens, vol['sigma_a']), a.inputs['Density'])
    nt.links.new(s.outputs[0], add.inputs[0]); nt.links.new(a.outputs[0], add.inputs[1])
    nt.links.new(add.outputs[0], out.inputs['Volume'])
    me.materials.append(m)
    link('volume', me)

w = bpy.data.worlds.new('world'); sc.world = w; w.use_nodes = True
bg = w.node_tree.nodes['Background']; e = S['environment']['radiance']; k = max(e)
bg.inputs['Color'].default_value = [q / k if k else 0 for q in e] + [1]
bg.inputs['Strength'].default_value = k

if S.get('sun'):
    sun = bpy.data.lights.new('sun', 'SUN'); E = S['sun']['irradiance_at_normal_incidence']; k = max(E)
    sun.energy = k; sun.color = [q / k for q in E]
    sun.angle = math.radians(S['sun']['angular_diameter_deg'])
    ob = link('sun', sun)
    ob.rotation_euler = Vector(S['sun']['direction_to_sun']).to_track_quat('Z', 'Y').to_euler()

C = S['camera']
eye, target, up = (Vector(C[k]) for k in ('eye', 'target', 'up'))
z = (eye - target).normalized(); x = up.cross(z).normalized(); y = z.cross(x)
cam = bpy.data.cameras.new('cam'); cam.sensor_fit = 'VERTICAL'; cam.angle_y = math.radians(C['vfov_deg'])
cam.clip_start = 0.001; cam.clip_end = 1000
co = link('cam', cam)
co.matrix_world = Matrix(((x[0], y[0], z[0], eye[0]), (x[1], y[1], z[1], eye[1]), (x[2], y[2], z[2], eye[2]), (0, 0, 0, 1)))
sc.camera = co

r, c = sc.render, sc.cycles
r.resolution_x, r.resolution_y, r.resolution_percentage = A.size or C['width'], A.size or C['height'], 100
r.threads_mode, r.threads = 'FIXED', A.threads
r.use_compositing = r.use_sequencer = False
c.pixel_filter_type, c.filter_width = 'BOX', 1.0
depth = (A.depth or S['integrator']['max_scatter_events']) - 1       # Cycles counts the bounces after the first hit
c.max_bounces = c.diffuse_bounces = c.glossy_bounces = c.transmission_bounces = c.volume_bounces = depth
c.transparent_max_bounces = 64
c.caustics_reflective = c.caustics_refractive = True
c.blur_glossy = 0; c.sample_clamp_direct = c.sample_clamp_indirect = 0; c.light_sampling_threshold = 0
c.use_denoising = False; c.sampling_pattern = A.pattern
c.volume_step_rate = A.step_rate; c.volume_max_steps = 1024
c.use_adaptive_sampling = A.adaptive > 0
if A.adaptive:
    c.adaptive_threshold, c.adaptive_min_samples = A.adaptive, 0
c.seed = A.seed
im = r.image_settings

for spp in map(int, A.spp.split(',')):
    c.samples = spp
    t = time.perf_counter(); cpu = time.process_time()
    bpy.ops.render.render()
    t = time.perf_counter() - t; cpu = time.process_time() - cpu
    im.file_format, im.color_mode, im.color_depth, im.exr_codec = 'OPEN_EXR', 'RGB', '32', 'NONE'
    stem = os.path.join(A.out, '%s_%s_%d' % (S['name'], A.tag, spp))
    bpy.data.images['Render Result'].save_render(stem + '.exr')
    img = bpy.data.images.load(stem + '.exr'); img.colorspace_settings.name = 'Linear'
    wd, ht = img.size
    px = np.empty(wd * ht * img.channels, np.float32); img.pixels.foreach_get(px)
    px = px.reshape(ht, wd, img.channels)[:, :, :3]
    bpy.data.images.remove(img); os.remove(stem + '.exr')
    with open(stem + '.pfm', 'wb') as f:                              # PFM rows run bottom-up, as Blender's do
        f.write(b'PF\n%d %d\n-1.0\n' % (wd, ht)); f.write(px.astype('<f4').tobytes())
    with open(os.path.join(A.out, 'times.jsonl'), 'a') as f:
        f.write(json.dumps(dict(scene=S['name'], tag=A.tag, spp=spp, wall=round(t, 3), cpu=round(cpu, 3), seed=A.seed,
                                size=[wd, ht], mean=[float(q) for q in px.mean((0, 1), dtype=np.float64)])) + '\n')
    print('RESULT', S['name'], A.tag, spp, '%.3f s' % t, 'cpu %.2f' % cpu, px.mean((0, 1), dtype=np.float64))
    if A.save_exr:
        im.color_depth, im.exr_codec = '16', 'ZIP'
        bpy.data.images['Render Result'].save_render(A.save_exr)
