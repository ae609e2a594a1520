#pragma once
// Wrenches on their way in and joint loads on their way out: between the user's joint frames and
// the frames of the core, whose joint axes are z.
#include "linkwise/kinematics/sweep_input.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Wrench of row `joint` of a user array, turned into its body's frame.
template <class S>
LW_INLINE Force<S> user_wrench(const S* external, const JointInfo& joint, int index) {
  const S* w = external + 6 * index;
  return transpose_times(joint.to_user, Force<S>{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}});
}

/// f(body, wrench) for all bodies, where there are external wrenches.
template <class S, class F>
LW_INLINE void for_external_wrenches(const Model& model, const SweepInput<S>& in, F&& f) {
  for (int j = 0; in.external && j < model.n_joints(); ++j)
    if (const JointInfo& joint = model.joints[j]; joint.last_of_body)
      f(joint.body, user_wrench(in.external, joint, j));
}

/// Load of joint j in the user's joint frame, [6], from the wrench on its body in the body's own. A
/// joint inside a stack carries the same wrench as the body, moved to its own point.
template <class S>
LW_INLINE void store_joint_load(const Model& model, int j, const S* q, Force<S> w, S* out) {
  const JointInfo& joint = model.joints[j];
  if (!joint.last_of_body) {
    const BodyTopology& body = model.topology[joint.body];
    for (int e = body.first_element + body.n_elements - 1;
         e >= joint.first_element + joint.n_elements; --e)
      w = transpose_times(element_pose(model.elements[e], q), w);
  }
  const Force<S> user = inverse_transpose_times(joint.to_user, w);
  out[0] = user.lin.x;
  out[1] = user.lin.y;
  out[2] = user.lin.z;
  out[3] = user.ang.x;
  out[4] = user.ang.y;
  out[5] = user.ang.z;
}

/// Joint loads [n_joints][6] from wrench(n), body n's in its own frame.
template <class S, class W>
void store_joint_loads(const Model& model, const S* q, W&& wrench, S* loads) {
  for (int j = model.n_joints() - 1; j >= 0; --j)
    store_joint_load<S>(model, j, q, wrench(model.joints[j].body), loads + 6 * j);
}

}  // namespace linkwise
