#pragma once
// Loads inside elastic beams: the wrench that the inboard part of a beam puts on its outboard part
// at a section, by equilibrium of the outboard part,
//     w(x) = X^T w_end + int_x^L (r - r_x, mu a) + rotary inertia,
// with accelerations less gravity. At x = 0 it is the load of the inboard joint to rounding. What
// the sections' own strains say, EI kappa and the like, differs by as much as the coordinates of
// the beam cannot follow.
#include <string>
#include <vector>

#include "linkwise/dynamics/inverse_dynamics.hpp"

namespace linkwise {

/// A section of a beam: its body, and how far from the beam's start [m].
struct BeamSection {
  int body;
  double x;
};

class SectionLoads {
 public:
  /// Throws InputError where a body is no beam, or a section is not on it.
  SectionLoads(const Model& model, std::vector<BeamSection> sections);

  /// Of a state with its accelerations and joint loads [n_loads][6]: `loads` [sections][6], in the
  /// axes of each section as bent, x along the beam; `elastic` [sections][4], what strains and
  /// damping say of the force along x and of the moments about x, y, z.
  void evaluate(const SweepInput<double>& in, const double* du, const double* joint_loads,
                double* loads, double* elastic);

 private:
  struct Cut {
    const Beam* beam;
    int body, joint;  ///< whose port carries the beam's end
    BeamModes::Station at;
    std::vector<BeamModes::Station> outboard;  ///< with their masses
  };

  Force<double> outboard_load(const Cut& cut, const SweepInput<double>& in, const double* du) const;

  const Model& model_;
  InverseDynamics<double> dynamics_;
  std::vector<Cut> cuts_;
};

/// Where sections are, and what their strains say, of positions alone.
class BentSections {
 public:
  /// Throws as SectionLoads does.
  BentSections(const Model& model, const std::vector<BeamSection>& sections);

  /// `poses` [sections]: body's frame -> the section's as bent, x along the beam; `elastic`
  /// [sections][4]: the force along x and the moments about x, y, z that strains say, signed as
  /// loads of sections.
  void evaluate(const double* q, Transform<double>* poses, double* elastic) const;

 private:
  struct Cut {
    const Beam* beam;
    int body;
    BeamModes::Station at;
  };

  const Model& model_;
  std::vector<Cut> cuts_;
};

}  // namespace linkwise
