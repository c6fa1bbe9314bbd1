"""Mechanics of a planar Cosserat rod in a bending test: numpy and scipy only, no files, photos, plots or clocks.

Symbols, the same in every module, SI units throughout:

    x, y       m       chord frame: origin at the left bearing axis, x to the right one, y toward the bow
    s, L       m       arc length from the left axis; length of the cable from axis to axis
    theta      rad     tangent angle from x toward y; alpha where it belongs to an edge of the discrete rod
    K (kappa)  1/m     curvature, K = -dtheta/ds, positive in the direction of the bow
    K0         1/m     pre-curvature: K of the cable at rest
    P          N       force along the chord, positive in compression
    m          N m     bending moment; between moment-free bearings m = P y (Eq. (13))
    f_EI       N m^2   bending stiffness characteristic, read as tangent dm/dK unless a name says secant
    d          m       displacement of the pushed bearing, positive where the bearings approach

Where to begin: `characteristic` (what f_EI is), `bending_test` (the experiment simulated), `inverse` and `balance` (the
two ways from a measured test to f_EI), `paper` (the source paper's own numbers).

Source: *Identification of Nonlinear Elastic Bending Behavior for Cable Simulation*; modules cite its equations as
"Eq. (n) of the paper" and say where they depart from it.
"""
