#pragma once
// What a joint lets through, as the constraint-force system sees it: the wrench it transmits is
//     w = known + B f,      B = [P^+T of the degrees of freedom with armature | complement of P]
// known = P^+T tau over the others. A degree of freedom with armature I transmits an unknown torque
// s = tau - I du, so its row reads P^+ (a_n - X a_p - c) + s / I = tau / I: a compliance 1/I on the
// diagonal of A keeps the system symmetric and local. Prescribed degrees of freedom are
// constraints.
#include <algorithm>
#include <limits>

#include "linkwise/base/error.hpp"
#include "linkwise/joints/complement.hpp"
#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

template <class S>
struct JointConstraint {
  int rows = 0;          ///< columns of B, 0 to 6
  int free = 0;          ///< degrees of freedom
  int dof[6];            ///< their indices in v
  Vector6<S> B[6];       ///< column by column
  double compliance[6];  ///< 1 / armature, or 0
  int armature_of[6];    ///< column -> degree of freedom index in v, or -1
  Vector6<S> dual[6];    ///< P^+T: du_i = dual_i . (a_n - X a_p - c)
};

/// What is said of a body whose inertia is singular: it has no compliance.
inline std::string singular_inertia(const Model& model, int body,
                                    const char* method = "constraint_force") {
  return "body '" + model.body_name(body) + "'" + model.where() +
         " has a singular inertia, which method " + method +
         " cannot take; give it mass and inertia about every axis, or use method articulated_body";
}

/// InputError naming the first such body.
inline void require_regular_inertias(const Model& model, const char* method = "constraint_force") {
  if (const int body = model.singular_body(); body >= 0)
    throw InputError(singular_inertia(model, body, method));
}

/// Columns of B of body n: what its joint constrains or drives through a rotor.
inline int constraint_rows(const Model& model, int n) {
  const BodyTopology& body = model.topology[n];
  const auto& armature = model.dof_values(DofProperty::armature);
  int rows = 6;
  for (int i = 0; i < body.n_elements; ++i) {
    const Element& e = model.elements[body.first_element + i];
    if (e.kind == ElementKind::elastic) continue;  // its coordinates are the parent's
    for (int k = 0; k < e.nv; ++k)
      if (!e.prescribed && !(armature[e.v + k] > 0)) --rows;
  }
  return rows;
}

/// P as columns: one for a one-axis joint. Where they are dependent, all is NaN: no factor exists.
inline void calc_joint_constraint(const Motion<double>* P, const int* dof, int n,
                                  const std::vector<double>& armature,
                                  JointConstraint<double>& out) {
  Vector6<double> complement[6];
  out.free = n;
  out.rows = 0;
  calc_complement(P, n, out.dual, complement);
  if (n > 1 && are_dependent(P, n, out.dual)) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (int i = 0; i < n; ++i) out.dual[i].fill(none);
    for (int i = 0; i < 6 - n; ++i) complement[i].fill(none);
  }
  for (int i = 0; i < n; ++i) {
    out.dof[i] = dof[i];
    if (!(armature[dof[i]] > 0)) continue;
    out.B[out.rows] = out.dual[i];
    out.compliance[out.rows] = 1 / armature[dof[i]];
    out.armature_of[out.rows++] = dof[i];
  }
  for (int i = 0; i < 6 - n; ++i) {
    out.B[out.rows] = complement[i];
    out.compliance[out.rows] = 0;
    out.armature_of[out.rows++] = -1;
  }
}

/// Lane by lane: the columns are chosen by comparisons.
template <class S>
void calc_joint_constraint(const Motion<S>* P, const int* dof, int n,
                           const std::vector<double>& armature, JointConstraint<S>& out) {
  for (int l = 0; l < lane_count<S>; ++l) {
    Motion<double> columns[6];
    for (int i = 0; i < n; ++i) {
      const Vector6<S> column = to_array(P[i]);
      Vector6<double> one;
      for (int r = 0; r < 6; ++r) one[r] = lane(column[r], l);
      columns[i] = to_motion(one.data());
    }
    JointConstraint<double> one;
    calc_joint_constraint(columns, dof, n, armature, one);
    out.rows = one.rows;
    out.free = one.free;
    std::copy(one.dof, one.dof + one.free, out.dof);
    std::copy(one.compliance, one.compliance + one.rows, out.compliance);
    std::copy(one.armature_of, one.armature_of + one.rows, out.armature_of);
    for (int r = 0; r < 6; ++r) {
      for (int i = 0; i < one.rows; ++i) set_lane(out.B[i][r], l, one.B[i][r]);
      for (int i = 0; i < one.free; ++i) set_lane(out.dual[i][r], l, one.dual[i][r]);
    }
  }
}

}  // namespace linkwise
