# Writes clifford_light.obj, clifford_dark.obj and clifford_rings.obj: the flat torus that halves the sphere of four dimensions, in the chart of the
# lens space L(5, 2), whose middle lies on it. Tiles of a 20 by 20 grid; each block of 4 by 4 has a window of 2 by 2.
from math import sin, cos, pi, sqrt
RHO, P, N, SUB, THICK = 4, 5, 20, 3, 0.025

def place(alpha, a, b):
    x, y, z, w = sin(alpha) * cos(a), sin(alpha) * sin(a), cos(alpha) * sin(b), cos(alpha) * cos(b)
    return ((x - w) / sqrt(2), y, z, (x + w) / sqrt(2))

def is_window(i, j): return i % 4 in (1, 2) and j % 4 in (1, 2)

for parity, name in ((0, "light"), (1, "dark")):
    vertices, faces, index = [], [], {}
    def vertex(alpha, a, b):
        x, y, z, w = place(alpha, a, b)
        key = tuple(round(RHO * c / w, 4) for c in (x, y, z))
        if key not in index:
            index[key] = len(vertices) + 1
            vertices.append(key)
        return index[key]
    def quad(corners): faces.append([vertex(*c) for c in corners])
    for i in range(-N // 2, N // 2):
        for j in range(-N // 2, N // 2):
            if is_window(i, j) or (i + j) % 2 != parity: continue
            a0, b0, s = 2 * pi * i / N, 2 * pi * j / N, 2 * pi / N
            if min(place(pi / 4, a0 + s * u, b0 + s * v)[3] for u in (0, 1) for v in (0, 1)) < 0.1: continue
            inner, outer, d = pi / 4 - THICK, pi / 4 + THICK, s / SUB
            for u in range(SUB):
                for v in range(SUB):
                    a, b = a0 + u * d, b0 + v * d
                    quad([(inner, a, b), (inner, a, b + d), (inner, a + d, b + d), (inner, a + d, b)])
                    quad([(outer, a, b), (outer, a + d, b), (outer, a + d, b + d), (outer, a, b + d)])
            for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                if not is_window(i + di, j + dj): continue
                for k in range(SUB):
                    if di: e = [(a0 + (di > 0) * s, b0 + (k + t) * d) for t in (0, 1)]
                    else: e = [(a0 + (k + t) * d, b0 + (dj > 0) * s) for t in (0, 1)]
                    quad([(inner, *e[0]), (outer, *e[0]), (outer, *e[1]), (inner, *e[1])])
    with open(f"clifford_{name}.obj", "w") as f:
        f.write("# Tiles of a flat torus in the chart of L(5, 2), radius 4; see clifford.py.\n")
        for v in vertices: f.write("v %g %g %g\n" % v)
        for q in faces: f.write("f " + " ".join(map(str, q)) + "\n")
    print(name, len(vertices), len(faces))

vertices, faces = [], []
for b in [k * pi / P for k in range(-4, 6)]:
    steps = 96
    for k in range(steps):
        a = 2 * pi * k / steps, 2 * pi * (k + 1) / steps
        if min(place(0.52, t, b)[3] for t in a) < 0.1: continue
        first = len(vertices)
        for t in a:
            for alpha, off in ((0.505, -0.014), (0.53, -0.014), (0.53, 0.014), (0.505, 0.014)):
                x, y, z, w = place(alpha, t, b + off)
                vertices.append(tuple(round(RHO * c / w, 4) for c in (x, y, z)))
        for m in range(4): faces.append([first + 1 + m, first + 1 + (m + 1) % 4, first + 5 + (m + 1) % 4, first + 5 + m])
with open("clifford_rings.obj", "w") as f:
    f.write("# Rings around the core of one half, two a turn.\n")
    for v in vertices: f.write("v %g %g %g\n" % v)
    for q in faces: f.write("f " + " ".join(map(str, q)) + "\n")
