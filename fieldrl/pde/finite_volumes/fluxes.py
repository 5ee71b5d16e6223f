"""Compiled stencils of the finite-volume scheme, Eq. (29).

The unknowns are cell averages. On the face between two cells the flux is

    F = U C + U' M - |U| D - rho G

| symbol | meaning | lives on |
|---|---|---|
| U | mean normal velocity of the face, the difference of psi between its two vertices | face |
| C, D, G | value, upwind dissipation, normal gradient, from the K cells on either side | face |
| U', M | slope of U along the face and first moment of the value along it | face |
| psi | streamfunction, with one extrapolated vertex outside every wall | vertices (nx + 3, ny + 3) |

C and G are of order 2 K, with D of order 2 K - 1. The term U' M is there because the mean of a product is not
the product of the means; it is what a scheme of order > 2 in two dimensions needs.

A flow without streamfunction has two psi instead of one, psi_x and psi_y: running sums, along y and along x,
of the mean velocities of the faces (``face_means``). The arithmetic is the same.

Differences of one psi are exactly divergence-free, so a constant field stays constant; what leaves a cell
enters its neighbour, so mass is kept to rounding. Walls mirror the field (homogeneous Neumann).

Arrays are flat with K ghost cells on every side and rows along y padded to whole vectors; indices are
unsigned because numba wraps signed ones round, which keeps LLVM from vectorising the loops.
"""

from __future__ import annotations

from numba import njit, uintp

from fieldrl.pde.finite_volumes.stencils import VECTOR

OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "nsz"}}
_0, _1, _2, _3, _8 = uintp(0), uintp(1), uintp(2), uintp(3), uintp(VECTOR)
_NEAR, _FAR = 41 / 720, -11 / 1440  # first moment of a row of averages, exact for cubics


@njit(**OPTIONS)
def mirror(c, shape):
    """Fill the ghosts of c so that the field is even about every wall."""
    nx, ny, g, row = shape.nx, shape.ny, shape.ghosts, shape.row
    for i in range(g, nx + g):
        cells = c[i * row : (i + 1) * row]
        for k in range(g):
            cells[g - 1 - k] = cells[g + k]
            cells[ny + g + k] = cells[ny + g - 1 - k]
    for k in range(g):
        c[(g - 1 - k) * row : (g - k) * row] = c[(g + k) * row : (g + k + 1) * row]
        c[(nx + g + k) * row : (nx + g + k + 1) * row] = c[(nx + g - 1 - k) * row : (nx + g - k) * row]


@njit(**OPTIONS)
def moment_along(c, at, stride, out, start, n):
    """First moment of the value within each of n cells along ``stride``, in cell sizes."""
    for j in range(n):
        p = at + j
        near = c[p + stride] - c[p - stride]
        far = c[p + stride + stride] - c[p - stride - stride]
        out[start + j] = _NEAR * near + _FAR * far


@njit(**OPTIONS)
def face_flux_x(
    c, at, stride, psi, vertex, m, m0, m1, m2, m3, even, upwind, diffusion, per_y, flux, start, n
):
    """Flux through n faces normal to x, whose cells of greater x begin at ``at``."""
    pairs = len(even)
    for j in range(n):
        value, jump, gradient = 0.0, 0.0, 0.0
        p = at + j
        q = p - stride
        for k in range(pairs):
            right, left = c[p], c[q]
            value += even[k] * (right + left)
            jump += upwind[k] * (right - left)
            gradient += diffusion[k] * (right - left)
            p += stride
            q -= stride
        v = vertex + j
        a, b, d, e = psi[v], psi[v + _1], psi[v + _2], psi[v + _3]
        speed = (b - d) * per_y
        slope = (0.5 * per_y) * ((d - e) - (a - b))
        moment = (7 / 12) * (m[m1 + j] + m[m2 + j]) - (1 / 12) * (m[m0 + j] + m[m3 + j])
        flux[start + j] = speed * value + slope * moment - abs(speed) * jump - gradient


@njit(**OPTIONS)
def face_flux_y(c, at, psi, vertex, stride, m, even, upwind, diffusion, per_x, flux, n):
    """Flux through n faces normal to y, whose cells of greater y begin at ``at``."""
    pairs = len(even)
    for j in range(n):
        value, jump, gradient = 0.0, 0.0, 0.0
        p = at + j
        q = p - _1
        for k in range(pairs):
            right, left = c[p], c[q]
            value += even[k] * (right + left)
            jump += upwind[k] * (right - left)
            gradient += diffusion[k] * (right - left)
            p += _1
            q -= _1
        v = vertex + j
        a, b, d, e = psi[v], psi[v + stride], psi[v + stride + stride], psi[v + stride + stride + stride]
        speed = (d - b) * per_x
        slope = (0.5 * per_x) * ((e - d) - (b - a))
        moment = (7 / 12) * (m[j + _1] + m[j + _2]) - (1 / 12) * (m[j] + m[j + _3])
        flux[j] = speed * value + slope * moment - abs(speed) * jump - gradient


@njit(**OPTIONS)
def _close(flux, start, is_open, n):
    """Shut the faces of a row where ``is_open`` is 0."""
    for j in range(n):
        flux[start + j] *= is_open[j]


@njit(**OPTIONS)
def _update(flux_x, low, high, flux_y, base, at, step, per_x, per_y, out, n):
    """out = base + step * (what flows in - what flows out) for n cells of a row."""
    for j in range(n):
        rate = (flux_x[low + j] - flux_x[high + j]) * per_x + (flux_y[j] - flux_y[j + _1]) * per_y
        out[at + j] = base[at + j] + step * rate


@njit(**OPTIONS)
def stage(c, psi_x, psi_y, base, out, step, rate, shape, weights, walls, work):
    """out = base + step (L c + rate), with the L of this flow: what a time step is made of.

    Args:
        c: padded cells, ghosts filled.
        psi_x: streamfunction as ``vertices`` lays it out; its differences along y are what faces normal to
            x let through [length^2/time].
        psi_y: the same for differences along x and faces normal to y; psi_x itself where there is one psi.
        base: padded cells.
        out: padded cells to write, another array than c and base.
        step: [time].
        rate: source, padded cells, or empty [field unit/time].
        shape: Layout.
        weights: Stencils.
        walls: Walls.
        work: Scratch.
    """
    g, row, n = uintp(shape.ghosts), uintp(shape.row), uintp(shape.whole)
    vertices, ring = n + _3 + _8, n + _8
    even, per_x, per_y = weights.even, weights.per_x, weights.per_y
    low, high, closed = _0, ring, walls.cells.size > 0
    flux_x, flux_y, m = work.flux_x, work.flux_y, work.moment_x
    for r in range(3):
        moment_along(c, (g - _2 + uintp(r)) * row + g, _1, m, uintp(r) * ring, n)
    for face in range(shape.nx + 1):
        f = uintp(face)
        at = (f + g) * row + g
        rows = (f & _3, (f + _1) & _3, (f + _2) & _3, (f + _3) & _3)
        m0, m1, m2, m3 = rows[0] * ring, rows[1] * ring, rows[2] * ring, rows[3] * ring
        moment_along(c, at + row, _1, m, m3, n)
        face_flux_x(c, at, row, psi_x, (f + _1) * vertices, m, m0, m1, m2, m3,
                even, weights.upwind, weights.diffusion_x, per_y, flux_x, high, n)  # fmt: skip
        if closed:
            _close(flux_x, high, walls.open_x[face], n)
        if face > 0:
            at -= row
            moment_along(c, at - _2, row, work.moment_y, _0, n + _8)
            face_flux_y(c, at, psi_y, (f - _1) * vertices + _1, vertices, work.moment_y,
                    even, weights.upwind, weights.diffusion_y, per_x, flux_y, n)  # fmt: skip
            if closed:
                _close(flux_y, _0, walls.open_y[face - 1], n)
            _update(flux_x, low, high, flux_y, base, at, step, per_x, per_y, out, n)
        low, high = high, low
    if rate.size > 0:
        for p in range(uintp(out.size)):
            out[p] += step * rate[p]


@njit(**OPTIONS)
def fill(c, shape, walls):
    """Fill the ghosts and the solid cells of c."""
    for k in range(walls.cells.size):
        c[walls.cells[k]] = c[walls.nearest[k]]
    mirror(c, shape)


@njit(**OPTIONS)
def advance(c, psi_x, psi_y, rates, step, chain, shape, weights, walls, work, spare):
    """Carry the cells c over one substep for each level of the flow, in place.

    A substep applies the polynomial of degree len(chain) that ``chain`` nests (see stepping).

    Args:
        c: padded cells.
        psi_x: frozen flow of each substep, see ``stage``, (substeps, vertices) [length^2/time].
        psi_y: the same.
        rates: frozen source of each substep, (substeps, size), or (substeps, 0).
        step: length of a substep [time].
        chain: fractions of the substep, first stage first.
        shape: Layout.
        weights: Stencils.
        walls: Walls.
        work: Scratch.
        spare: two more arrays like c, (2, size).
    """
    for level in range(psi_x.shape[0]):
        source, into = c, 0
        for fraction in chain:
            fill(source, shape, walls)
            stage(source, psi_x[level], psi_y[level], c, spare[into], fraction * step, rates[level], shape,
                  weights, walls, work)  # fmt: skip
            source, into = spare[into], 1 - into
        c[:] = source


@njit(**OPTIONS)
def vertices(psi, shape, out):
    """Lay out psi (levels, nx + 1, ny + 1) for ``stage``, with an extrapolated vertex round it, in out."""
    nx, ny, row = shape.nx, shape.ny, shape.whole + 3 + VECTOR
    for level in range(psi.shape[0]):
        grid = out[level].reshape(nx + 3, row)
        for i in range(nx + 1):
            inner = grid[i + 1]
            inner[1 : ny + 2] = psi[level, i]
            inner[0] = 3 * inner[1] - 3 * inner[2] + inner[3]
            inner[ny + 2] = 3 * inner[ny + 1] - 3 * inner[ny] + inner[ny - 1]
        for j in range(ny + 3):
            grid[0, j] = 3 * grid[1, j] - 3 * grid[2, j] + grid[3, j]
            grid[nx + 2, j] = 3 * grid[nx + 1, j] - 3 * grid[nx, j] + grid[nx - 1, j]


@njit(**OPTIONS)
def close_walls(psi):
    """Make psi (levels, nx + 1, ny + 1) constant on the outer walls where it is so but for rounding."""
    for level in psi:
        nx, ny = level.shape
        low, high, total, largest = level[0, 0], level[0, 0], 0.0, 0.0
        for i in range(nx):
            on_wall = i == 0 or i == nx - 1
            for j in range(ny):
                value = level[i, j]
                largest = max(largest, abs(value))
                if on_wall or j == 0 or j == ny - 1:
                    low, high, total = min(low, value), max(high, value), total + value
        if high - low <= 1e-10 * largest:
            mean = total / (2 * (nx + ny) - 4)
            level[0], level[nx - 1], level[:, 0], level[:, ny - 1] = mean, mean, mean, mean


@njit(**OPTIONS)
def crossing_rate(psi_x, psi_y, per_x, per_y):
    """S, the most cells that water crosses per time, over all levels (levels, nx + 1, ny + 1)."""
    scale, fastest = per_x * per_y, 0.0
    for level in range(psi_x.shape[0]):
        for i in range(psi_x.shape[1] - 1):
            near, far = psi_x[level, i], psi_x[level, i + 1]
            below, above = psi_y[level, i], psi_y[level, i + 1]
            for j in range(near.size - 1):
                u = max(abs(near[j] - near[j + 1]), abs(far[j] - far[j + 1]))
                v = max(abs(above[j] - below[j]), abs(above[j + 1] - below[j + 1]))
                fastest = max(fastest, u + v)
    return fastest * scale
