#include "linkwise/kinematics/frame_motion.hpp"

#include <algorithm>
#include <vector>

namespace linkwise {
namespace {

/// Elements between a joint's frame and the ground, from the joint inward.
std::vector<const Element*> elements_inward(const Model& model, int joint) {
  std::vector<const Element*> path;
  if (joint < 0) return path;
  int body = model.joints[joint].body;
  int last = model.joints[joint].first_element + model.joints[joint].n_elements - 1;
  while (body >= 0) {
    for (int i = last; i >= model.topology[body].first_element; --i)
      path.push_back(&model.elements[i]);
    body = model.topology[body].parent;
    if (body >= 0) last = model.topology[body].first_element + model.topology[body].n_elements - 1;
  }
  return path;
}

/// The frame of the last element, or the world at the ground -> frame.
Transform<double> from_last_element(const Model& model, const FramePlacement& frame) {
  if (frame.joint < 0) return frame.placement;
  return frame.placement * model.joints[frame.joint].to_user;
}

}  // namespace

FrameMotion frame_motion(const Model& model, const double* q, const double* v, const double* du,
                         const FramePlacement& frame) {
  FrameMotion at{{Mat3<double>::identity(), {}}, {}, {}};
  const auto path = elements_inward(model, frame.joint);
  for (auto e = path.rbegin(); e != path.rend(); ++e) {
    const Element& element = **e;
    const Transform<double> X = element_pose(element, q);
    Motion<double> own{}, change{};  // P u, and P du + dP u
    for_columns(element, q, [&](int k, const Motion<double>& column) {
      if (v) own += v[element.v + k] * column;
      if (du) change += du[element.v + k] * column;
    });
    if (v && element.kind == ElementKind::elastic) {
      ElasticPort<double> port;
      calc_elastic_port(*element.shape, q + element.q, port);
      change += elastic_column_rate(*element.shape, port, v + element.v, own);
    }
    at.pose = X * at.pose;
    at.velocity = X * at.velocity;
    at.velocity += own;
    at.acceleration = X * at.acceleration;
    at.acceleration += change;
    at.acceleration += cross(at.velocity, own);
  }
  const Transform<double> X = from_last_element(model, frame);
  at = {X * at.pose, X * at.velocity, X * at.acceleration};
  at.acceleration.lin += cross(at.velocity.ang, at.velocity.lin);
  return at;
}

void frame_jacobian(const Model& model, const double* q, const FramePlacement& frame,
                    bool world_axes, double* J) {
  const int nv = model.nv();
  std::fill_n(J, 6 * nv, 0.0);
  const auto path = elements_inward(model, frame.joint);
  const auto store = [&](int dof, const Motion<double>& c) {
    const double column[6] = {c.lin.x, c.lin.y, c.lin.z, c.ang.x, c.ang.y, c.ang.z};
    for (int r = 0; r < 6; ++r) J[r * nv + dof] = column[r];
  };
  Transform<double> X = from_last_element(model, frame);
  for (const Element* e : path) {
    for_columns(*e, q, [&](int k, const Motion<double>& column) { store(e->v + k, X * column); });
    X = X * element_pose(*e, q);
  }
  if (!world_axes) return;
  for (const Element* e : path)
    for (int k = e->v; k < e->v + e->nv; ++k)
      store(k, in_world_axes(X, {{J[k], J[nv + k], J[2 * nv + k]},
                                 {J[3 * nv + k], J[4 * nv + k], J[5 * nv + k]}}));
}

}  // namespace linkwise
