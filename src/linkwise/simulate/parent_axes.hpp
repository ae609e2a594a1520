#pragma once
// Linear rates of floating and planar joints as the integrators see them. In a state (q, v) they
// are components along the child's axes, which turn, so they change even where nothing acts:
//     d(R u)/dt = R (du/dt + w x u),
// with R the child's axes in the previous frame and w the angular rate. An integrator that steps
// R u instead meets a constant where momentum is conserved.
#include <vector>

#include "linkwise/model/model.hpp"

namespace linkwise {

class ParentAxes {
 public:
  explicit ParentAxes(const Model& model);

  /// Are all rates of the model the same in both?
  bool trivial() const { return elements_.empty(); }

  /// v [nv] of one state, from the axes of the child to those of the previous frame, and back.
  void from_child(const double* q, double* v) const;
  void to_child(const double* q, double* v) const;

  /// dv [nv], dv/dt of the rates v along the child's axes, becomes that along the previous frame's.
  void derivative_from_child(const double* q, const double* v, double* dv) const;
  /// And back.
  void derivative_to_child(const double* q, const double* v, double* dv) const;

 private:
  std::vector<Element> elements_;
};

}  // namespace linkwise
