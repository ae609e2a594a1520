#include "linkwise/simulate/given_motion.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

/// f(element, its quaternion in q) for every quaternion.
template <class Q, class F>
void for_quaternions(const Model& model, Q* q, F&& f) {
  for (const Element& e : model.elements)
    if (const int own = info_of(e.kind).quaternion; own >= 0) f(e, q + e.q + own);
}

double length(const double* p) {
  return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
}

}  // namespace

void normalise_quaternions(const Model& model, double* q) {
  for_quaternions(model, q, [](const Element&, double* p) {
    const double norm = length(p);
    for (int i = 0; i < 4; ++i) p[i] /= norm;
  });
}

void check_quaternions(const Model& model, const double* q) {
  if (model.nq() == model.nv()) return;  // there is none
  for_quaternions(model, q, [&](const Element& e, const double* p) {
    if (length(p) > 1e-6) return;
    const auto at = p - q;
    throw InputError("q[" + std::to_string(at) + ":" + std::to_string(at + 4) +
                     "]: the quaternion of joint '" + model.joints[e.joint].name + "'" +
                     model.where() + " has no length; give x, y, z, w of length 1");
  });
}

void check_locked_joints(const Model& model, const std::vector<Drive>& drives, const double* v0) {
  for (int j = 0; j < model.n_joints(); ++j) {
    if (drives[j].kind != DriveKind::locked) continue;
    const JointInfo& info = model.joints[j];
    for (int i = 0; i < info.nv; ++i)
      if (v0[info.v + i] != 0)
        throw InputError("joint '" + info.name + "'" + model.where() +
                         " is locked but starts with a rate; start it at rest");
  }
}

std::unique_ptr<const Model> driven_model(const Model& model, const std::vector<Drive>& drives) {
  std::vector<std::string> given;
  for (int j = 0; j < model.n_loads(); ++j)
    if (is_prescribed(drives[j].kind)) given.push_back(model.joint_at(j).name);
  if (given.empty()) return nullptr;
  ModelSpec spec = model.spec();
  spec.prescribed.insert(spec.prescribed.end(), given.begin(), given.end());
  return std::make_unique<const Model>(std::move(spec));
}

void impose_motion(const Model& model, const std::vector<Drive>& drives, double t, double* q,
                   double* v, double* a) {
  for (int j = 0; j < model.n_joints(); ++j) {
    if (drives[j].kind != DriveKind::motion) continue;
    const JointInfo& info = model.joints[j];
    evaluate_motion(info, drives[j], t, q + info.q, v + info.v, a + info.v);
  }
}

void rest_imposed(const Model& model, const std::vector<Drive>& drives, double* q_rate,
                  double* v_rate) {
  for (int j = 0; j < model.n_joints(); ++j) {
    if (drives[j].kind != DriveKind::motion) continue;
    const JointInfo& info = model.joints[j];
    std::fill_n(q_rate + info.q, info.nq, 0.0);
    std::fill_n(v_rate + info.v, info.nv, 0.0);
  }
}

}  // namespace linkwise
