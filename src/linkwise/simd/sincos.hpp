#pragma once
// sin and cos of every lane at once: Cody-Waite reduction by pi/2 in three parts and the minimax
// polynomials on [-pi/4, pi/4] of [sun-fdlibm]. No second word of the reduced argument is kept:
// errors stay below 1.6 ulp for |x| <= 1e3 and below 2.5 ulp for |x| <= 1e5. Larger arguments go to
// the C library, lane by lane.
#include "linkwise/simd/lanes.hpp"

namespace linkwise {

template <class S>
LW_INLINE void sincos_reduced(S x, S& sine, S& cosine) {
  using I = typename IntegerOf<S>::type;
  constexpr double magic = 6755399441055744.0;  // 1.5 * 2^52: the sum's low bits hold the integer
  const S shifted = x * 0.63661977236758134308 + magic;
  I quadrant;
  std::memcpy(&quadrant, &shifted, sizeof(S));
  const S n = shifted - magic;
  S y = x - n * 1.57079632673412561417e+00;
  y = y - n * 6.07710050630396597660e-11;
  y = y - n * 2.02226624879595063154e-21;
  const S z = y * y;
  const S s =
      y + y * z *
              (-1.66666666666666324348e-01 +
               z * (8.33333333332248946124e-03 +
                    z * (-1.98412698298579493134e-04 +
                         z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 +
                                                                z * 1.58969099521155010221e-10)))));
  const S c =
      1.0 - 0.5 * z +
      z * z *
          (4.16666666666666019037e-02 +
           z * (-1.38888888888741095749e-03 +
                z * (2.48015872894767294178e-05 +
                     z * (-2.75573143513906633035e-07 +
                          z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  const S sine_swapped = (quadrant & 1) != 0 ? c : s;
  const S cosine_swapped = (quadrant & 1) != 0 ? s : c;
  sine = (quadrant & 2) != 0 ? -sine_swapped : sine_swapped;
  cosine = ((quadrant + 1) & 2) != 0 ? -cosine_swapped : cosine_swapped;
}

template <class S>
LW_INLINE void sincos(S x, S& sine, S& cosine) {
  constexpr double limit = 1e5;
  sincos_reduced(x, sine, cosine);
  for (int i = 0; i < lane_count<S>; ++i) {
    const double xi = lane(x, i);
    if (__builtin_expect(!(xi <= limit && xi >= -limit), 0)) {
      set_lane(sine, i, std::sin(xi));
      set_lane(cosine, i, std::cos(xi));
    }
  }
}

}  // namespace linkwise
