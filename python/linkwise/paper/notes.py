"""What the report says about its tables and figures."""

INTRODUCTION = """
<p>I. Sharf and G. M. T. D'Eleuterio, <i>An Iterative Approach to Multibody Simulation Dynamics
Suitable for Parallel Implementation</i>, ASME J. Dyn. Syst. Meas. Control 115 (1993) 730-735,
computed again. Its manipulator is not available in public copies; SRMS-3L5D stands in for it:
three uniform rods with the lengths and masses of the Shuttle's arm, five degrees of freedom in a
universal, a revolute and a universal joint, 13 unknown constraint forces.</p>
"""
TABLE2_NOTE = """
<p class="note">T = 10 s, TOL = 1e-6, eps = 1e-7, Adams' method (CVODE, functional iteration),
cubic guess, the paper's stop test. Torques are the inverse dynamics of a motion whose end is known,
applied open loop; accuracy is the largest error of a joint angle at T, relative to the longest way
of a joint. Iterations are means over all evaluations that the integrator asks for. "Stand-in
elsewhere" is an independent computation of the same arm with another code for Adams' method.</p>
<p class="note">Why ours differ from the paper's. It is another arm: that of the paper is not
public. J-SI and SOR get the exact spectral radius at every evaluation, which suits the slow modes
whether a motion excites them or not; the paper had a "nearly optimal" factor for each maneuver, so
that its J-SI and SOR are faster in I, where the slow modes rest, and slower in II. Times
are the processor's for a whole run on this machine, against CPU seconds on a SUN 3/60.</p>
"""
SPREAD_NOTE = """
<p class="note">Where these counts differ from the other computation of the stand-in, it is by the
steps: an evaluation costs from one iteration (the corrector calls again at the same time) to
thousands (after a change of step the cubic misses), and what the stop test leaves of each solution
decides which steps are taken. Least and most mean counts of eleven runs with TOL changed by up to
5 %; and the same protocol with other codes for Adams' method, whose cubic passes through the last
four calls instead of the last four accepted steps. The counts of Gauss-Seidel in II, whose rest
steers the steps most, are the only ones not within 15 % of those computed elsewhere for all
tolerances.</p>
"""
OURS_NOTE = """
<p class="note">The same arm, TOL and integrator; guess: the best combination of the last sixteen
solutions in the A-norm; stop test: an estimate of the error in the A-norm, which is the
kinetic-energy norm of the acceleration error, at a tenth of what the integrator's error test
accepts. The last column is the distance from the end point in that test's norm and unit.</p>
"""
TIGHT_NOTE = """
<p class="note">The same with a fixed tolerance of 3e-9 of the solution: what is left at the end
point is the integrator's error, that of the direct solution.</p>
"""
FIG2_NOTE = """
<p class="note">Chains of equal rods without gravity on a fixed base slew from one bent pose to
another in 10 s, in 64 even steps, as many as Adams' method takes at TOL = 1e-6; every solution
starts from the cubic through the four before it. Times are means over the steps of the shortest of
several passes. "Error" is the largest error of the accelerations in the kinetic-energy norm,
relative to the largest acceleration: the paper's stop test, a relative change of 1e-7, leaves it
far behind on long chains.</p>
"""
FIG3_NOTE = """
<p class="note">Eqs. (20) and (21): T_P,i = (T_CPU - T_serial)/N + T_serial, and T_P,r with the
parallel part times 1.3. T_serial is measured by itself: the sums over all bodies, four per
iteration (two inner products, two norms of the stop test). With joint coordinates as the state,
passing velocities outward from body to body is serial too. No time for messages between processors
is counted.</p>
"""
