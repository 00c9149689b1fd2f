#!/usr/bin/env python3
"""Writes the benchmark scenes a-d as neutral JSON + OBJ/MTL files (see ../README.md).

  make_scenes.py OUTDIR [--big]     --big also writes c_terrain.obj (991,520 triangles, 37 MB) and
                                     the same as c_ground.ply and c_rocks.ply

Everything is closed-form and deterministic.  Right-handed, Y up, metres, linear Rec.709 RGB.
"""
import json, math, os, struct, sys

args = [a for a in sys.argv[1:] if not a.startswith('--')]
if not args:
    sys.exit(__doc__)
OUT = args[0]
BIG = '--big' in sys.argv
os.makedirs(OUT, exist_ok=True)


class Obj:
    """Collects polygons grouped by material; all faces counter-clockwise seen from the front."""
    def __init__(self):
        self.v, self.f, self.mats = [], [], []

    def poly(self, mat, *pts):
        base = len(self.v) + 1
        self.v += pts
        self.f.append((mat, [base + i for i in range(len(pts))]))
        if mat not in self.mats:
            self.mats.append(mat)

    def box(self, mat, centre, size, rot_y_deg):
        c, s = math.cos(math.radians(rot_y_deg)), math.sin(math.radians(rot_y_deg))
        hx, hy, hz = (k / 2 for k in size)

        def p(x, y, z):
            x, z = x * hx, z * hz
            return (centre[0] + c * x + s * z, centre[1] + y * hy, centre[2] - s * x + c * z)
        q = lambda *k: self.poly(mat, *[p(*i) for i in k])
        q((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1))
        q((1, -1, -1), (-1, -1, -1), (-1, 1, -1), (1, 1, -1))
        q((1, -1, 1), (1, -1, -1), (1, 1, -1), (1, 1, 1))
        q((-1, -1, -1), (-1, -1, 1), (-1, 1, 1), (-1, 1, -1))
        q((-1, 1, 1), (1, 1, 1), (1, 1, -1), (-1, 1, -1))
        q((-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1))

    def rect_down(self, mat, x0, x1, y, z0, z1):
        """Horizontal rectangle whose front faces down (-Y)."""
        self.poly(mat, (x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1))

    def rect_up(self, mat, x0, x1, y, z0, z1):
        self.poly(mat, (x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0))

    def write(self, name, materials):
        with open(os.path.join(OUT, name + '.obj'), 'w') as o:
            o.write('mtllib %s.mtl\n' % name)
            for p in self.v:
                o.write('v %.9g %.9g %.9g\n' % p)
            cur = None
            for mat, idx in self.f:
                if mat != cur:
                    o.write('usemtl %s\n' % mat)
                    cur = mat
                o.write('f ' + ' '.join(map(str, idx)) + '\n')
        write_mtl(name, {m: materials[m] for m in self.mats})


def write_mtl(name, mats):
    with open(os.path.join(OUT, name + '.mtl'), 'w') as o:
        for n, m in mats.items():
            kd = m.get('albedo', [0, 0, 0]) if m['type'] == 'lambert' else [0, 0, 0]
            ke = m['radiance'] if m['type'] == 'emitter' else [0, 0, 0]
            o.write('newmtl %s\nKd %g %g %g\nKe %g %g %g\n\n' % ((n,) + tuple(kd) + tuple(ke)))


def dump(name, d):
    with open(os.path.join(OUT, name + '.json'), 'w') as o:
        json.dump(d, o, indent=1)
        o.write('\n')


def write_ply(path, vertices, triangles):
    """The vertices that the triangles use, with the six decimals the OBJ file has, and the triangles; binary."""
    used = sorted({i for t in triangles for i in t})
    new = dict(zip(used, range(len(used))))
    with open(path, 'wb') as o:
        o.write(('ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\n'
                 'property float z\nelement face %d\nproperty list uchar int vertex_indices\nend_header\n'
                 % (len(used), len(triangles))).encode())
        o.write(b''.join(struct.pack('<3f', *(round(k, 6) for k in vertices[i])) for i in used))
        o.write(b''.join(struct.pack('<B3i', 3, *(new[i] for i in t)) for t in triangles))


def lam(*c):
    return {'type': 'lambert', 'albedo': list(c)}


def emitter(*c):
    return {'type': 'emitter', 'radiance': list(c), 'albedo': [0, 0, 0]}


def camera(eye, target, vfov):
    return {'type': 'pinhole', 'eye': eye, 'target': target, 'up': [0, 1, 0], 'vfov_deg': vfov,
            'width': 512, 'height': 512, 'pixel_filter': 'box, 1 pixel'}


# ---------------------------------------------------------------- a: Cornell box
mats = {'white': lam(0.725, 0.71, 0.68), 'red': lam(0.63, 0.065, 0.05),
        'green': lam(0.14, 0.45, 0.091), 'light': emitter(17, 12, 4)}
o = Obj()
o.rect_up('white', -1, 1, 0, -1, 1)                                     # floor
o.poly('white', (-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1))        # back wall
o.poly('red', (-1, 0, 1), (-1, 0, -1), (-1, 2, -1), (-1, 2, 1))          # left, x = -1
o.poly('green', (1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1))            # right, x = +1
L = 0.25                                                                 # ceiling with a hole for the light
o.rect_down('white', -1, 1, 2, -1, -L)
o.rect_down('white', -1, 1, 2, L, 1)
o.rect_down('white', -1, -L, 2, -L, L)
o.rect_down('white', L, 1, 2, -L, L)
o.rect_down('light', -L, L, 2, -L, L)
o.box('white', (0.33, 0.3, 0.35), (0.6, 0.6, 0.6), -17)
o.box('white', (-0.33, 0.6, -0.3), (0.6, 1.2, 0.6), 18)
o.write('a_cornell', mats)
dump('a_cornell', {
    'name': 'a_cornell', 'camera': camera([0, 1, 5], [0, 1, 0], 28.0),
    'integrator': {'max_scatter_events': 8}, 'materials': mats,
    'objects': [{'type': 'mesh', 'file': 'a_cornell.obj'}],
    'environment': {'radiance': [0, 0, 0]}, 'sun': None})

# ---------------------------------------------------------------- b: still life
mats = {'floor': lam(0.5, 0.5, 0.5), 'light': emitter(20, 19, 17),
        'metal': {'type': 'ggx_conductor', 'alpha': 0.2, 'fresnel': 'none (F = 1)',
                  'colour': [0.95, 0.75, 0.45], 'multiple_scattering': False},
        'glass': {'type': 'smooth_dielectric', 'ior': 1.5, 'colour': [1, 1, 1]},
        'plastic': {'type': 'mix', 'weight_b': 0.1, 'a': lam(0.1, 0.25, 0.6),
                    'b': {'type': 'ggx_conductor', 'alpha': 0.2, 'fresnel': 'none (F = 1)',
                          'colour': [1, 1, 1], 'multiple_scattering': False}}}
o = Obj()
o.rect_up('floor', -8, 8, 0, -8, 8)
o.rect_down('light', -2, -1, 3, 1, 2)
o.write('b_stilllife', mats)
dump('b_stilllife', {
    'name': 'b_stilllife', 'camera': camera([0, 1.2, 4.5], [0, 0.45, 0], 36.0),
    'integrator': {'max_scatter_events': 12}, 'materials': mats,
    'objects': [{'type': 'mesh', 'file': 'b_stilllife.obj'},
                {'type': 'sphere', 'centre': [-1.1, 0.5, 0], 'radius': 0.5, 'material': 'metal'},
                {'type': 'sphere', 'centre': [0, 0.5, 0.3], 'radius': 0.5, 'material': 'glass'},
                {'type': 'sphere', 'centre': [1.1, 0.5, 0], 'radius': 0.5, 'material': 'plastic'}],
    'environment': {'radiance': [0.4, 0.45, 0.5]}, 'sun': None})

# ---------------------------------------------------------------- c: ~1 M triangles, sun + sky
def height(x, z):
    s, c = math.sin, math.cos
    return (0.6 * s(0.7 * x + 1.3) * c(0.9 * z) + 0.25 * s(2.1 * x + 0.5 * z) * c(1.7 * z - 0.6 * x)
            + 0.08 * s(6.3 * x + 2.0 * z) * s(5.7 * z - 1.1 * x) + 0.03 * s(17 * x) * s(19 * z))


ROCKS = [((-2.6, 1.5, -1.0), 0.95, 0.3), ((0.2, 1.3, 1.6), 0.8, 1.1), ((2.9, 1.7, -0.4), 1.0, 2.0),
         ((-0.6, 2.6, -3.4), 1.2, 2.9), ((4.4, 1.2, -3.6), 0.9, 3.7), ((-4.9, 1.4, -3.9), 1.1, 4.5)]
GRID, SUBDIV, EXTENT = 500, 6, 10.0


def icosphere(n):
    t = (1 + 5 ** 0.5) / 2
    v = [(-1, t, 0), (1, t, 0), (-1, -t, 0), (1, -t, 0), (0, -1, t), (0, 1, t), (0, -1, -t), (0, 1, -t),
         (t, 0, -1), (t, 0, 1), (-t, 0, -1), (-t, 0, 1)]
    nrm = lambda p: tuple(k / math.sqrt(sum(q * q for q in p)) for k in p)
    v = [nrm(p) for p in v]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2),
         (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5),
         (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(n):
        mid, g = {}, []

        def m(a, b):
            k = (a, b) if a < b else (b, a)
            if k not in mid:
                mid[k] = len(v)
                v.append(nrm(tuple((v[a][i] + v[b][i]) / 2 for i in range(3))))
            return mid[k]
        for a, b, c in f:
            ab, bc, ca = m(a, b), m(b, c), m(c, a)
            g += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        f = g
    return v, f


def terrain_arrays():
    """(vertices, [(material, triangles)]) of scene c."""
    V, ground, rock = [], [], []
    n = GRID
    for j in range(n + 1):
        z = -EXTENT + 2 * EXTENT * j / n
        for i in range(n + 1):
            x = -EXTENT + 2 * EXTENT * i / n
            V.append((x, height(x, z), z))
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            b, c, d = a + 1, a + n + 1, a + n + 2
            ground += [(a, c, b), (b, c, d)]
    sv, sf = icosphere(SUBDIV)
    for cen, R, ph in ROCKS:
        base = len(V)
        for x, y, z in sv:
            r = R * (1 + 0.12 * math.sin(5 * x + ph) * math.sin(4 * y + 2 * ph) * math.sin(6 * z + ph)
                     + 0.03 * math.sin(19 * x) * math.sin(23 * y) * math.sin(17 * z))
            V.append((cen[0] + r * x, cen[1] + r * y, cen[2] + r * z))
        rock += [(a + base, b + base, c + base) for a, b, c in sf]
    return V, [('ground', ground), ('rock', rock)]


mats = {'ground': lam(0.45, 0.40, 0.33), 'rock': lam(0.70, 0.66, 0.60)}
sun_dir = [0.5, 0.7, 0.4]
k = math.sqrt(sum(q * q for q in sun_dir))
sc = {'name': 'c_terrain', 'camera': camera([0, 3.6, 9.0], [0, 1.0, -1.0], 42.0),
      'integrator': {'max_scatter_events': 5}, 'materials': mats,
      'objects': [{'type': 'mesh', 'file': 'c_terrain.obj', 'generate': 'make_scenes.py DIR --big',
                   'triangles': 2 * GRID * GRID + len(ROCKS) * 20 * 4 ** SUBDIV, 'normals': 'flat'}],
      'environment': {'radiance': [0.35, 0.5, 0.8]},
      'sun': {'direction_to_sun': [q / k for q in sun_dir], 'angular_diameter_deg': 0.53,
              'irradiance_at_normal_incidence': [3.0, 2.8, 2.4]}}
dump('c_terrain', sc)
sc2 = dict(sc, name='c_skyonly', sun=None)
dump('c_skyonly', sc2)
if BIG:
    V, groups = terrain_arrays()
    for name, (m, tris) in zip(('c_ground', 'c_rocks'), groups):
        write_ply(os.path.join(OUT, name + '.ply'), V, tris)
    with open(os.path.join(OUT, 'c_terrain.obj'), 'w') as f:
        f.write('mtllib c_terrain.mtl\n')
        f.writelines('v %.6f %.6f %.6f\n' % p for p in V)
        for m, tris in groups:
            f.write('usemtl %s\n' % m)
            f.writelines('f %d %d %d\n' % (a + 1, b + 1, c + 1) for a, b, c in tris)
write_mtl('c_terrain', mats)

# ---------------------------------------------------------------- d: fog box / smoke ball
mats = {'floor': lam(0.5, 0.5, 0.5), 'light': emitter(60, 56, 50)}
o = Obj()
o.rect_up('floor', -4, 4, 0, -4, 4)
o.rect_down('light', 0.5, 1.1, 3.5, 0.5, 1.1)
o.write('d_volume', mats)
base = {'camera': camera([0, 1.6, 5.5], [0, 0.9, 0], 34.0), 'integrator': {'max_scatter_events': 16},
        'materials': mats, 'objects': [{'type': 'mesh', 'file': 'd_volume.obj'}],
        'environment': {'radiance': [0, 0, 0]}, 'sun': None}
box = {'type': 'box', 'min': [-1, 0.05, -1], 'max': [1, 1.85, 1], 'phase': 'isotropic (g = 0)'}
dump('d_fog', dict(base, name='d_fog', volumes=[dict(box, sigma_s=1.5, sigma_a=0.1, density='1 everywhere')]))
dump('d_smoke', dict(base, name='d_smoke', volumes=[dict(
    box, sigma_s=8.0, sigma_a=0.5,
    density='max(0, 1 - r/0.85) * (0.5 + 0.5*sin(9x)*sin(9y)*sin(9z)), r = |p - (0,0.95,0)|, p in world space')]))
