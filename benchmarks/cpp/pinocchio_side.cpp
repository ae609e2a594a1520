#include <memory>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>
#include <string>

#include "contestant.hpp"
#include "machine.hpp"

namespace {

using Vector = Eigen::Map<const Eigen::VectorXd>;

struct Shared {
  States states;
  pinocchio::Model model;
  std::unique_ptr<pinocchio::Data> data;
};

/// The joint that Pinocchio's own URDF reader takes: the specialised one where an axis is x, y or
/// z.
pinocchio::JointModel joint_model(const Body& body) {
  const Eigen::Vector3d axis(body.axis);
  if (body.joint == "floating") return pinocchio::JointModelFreeFlyer();
  const bool turns = body.joint == "revolute";
  for (int k = 0; k < 3; ++k) {
    if (axis != Eigen::Vector3d::Unit(k)) continue;
    if (k == 0)
      return turns ? pinocchio::JointModel(pinocchio::JointModelRX()) : pinocchio::JointModelPX();
    if (k == 1)
      return turns ? pinocchio::JointModel(pinocchio::JointModelRY()) : pinocchio::JointModelPY();
    return turns ? pinocchio::JointModel(pinocchio::JointModelRZ()) : pinocchio::JointModelPZ();
  }
  if (turns) return pinocchio::JointModelRevoluteUnaligned(axis);
  return pinocchio::JointModelPrismaticUnaligned(axis);
}

void build(const Machine& machine, pinocchio::Model& model) {
  using Rows = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;
  model.gravity.linear() = Eigen::Vector3d(machine.gravity);
  std::vector<pinocchio::JointIndex> joints;
  for (const Body& body : machine.bodies) {
    const pinocchio::SE3 placement(Rows(body.rotation), Eigen::Vector3d(body.translation));
    const pinocchio::JointIndex parent = body.parent < 0 ? 0 : joints[body.parent];
    joints.push_back(model.addJoint(parent, joint_model(body), placement,
                                    "joint" + std::to_string(joints.size())));
    const double* I = body.inertia;
    Eigen::Matrix3d inertia;
    inertia << I[0], I[1], I[2], I[1], I[3], I[4], I[2], I[4], I[5];
    model.appendBodyToJoint(joints.back(), {body.mass, Eigen::Vector3d(body.com), inertia},
                            pinocchio::SE3::Identity());
  }
}

}  // namespace

Field make_pinocchio(const std::filesystem::path& folder) {
  const auto shared = std::make_shared<Shared>();
  shared->states = read_states(folder, "pinocchio");
  build(read_machine(folder), shared->model);
  shared->data = std::make_unique<pinocchio::Data>(shared->model);
  Field field;
  field.states = shared->states.count;
  for (const bool world : {true, false}) {
    const auto convention = world ? pinocchio::Convention::WORLD : pinocchio::Convention::LOCAL;
    field.contestants.push_back(
        {world ? "aba, world" : "aba, local", 1, 1, false, shared->model.nv,
         [shared, convention](int k) {
           const States& s = shared->states;
           return pinocchio::aba(shared->model, *shared->data, Vector(s.q_at(k), s.nq),
                                 Vector(s.v_at(k), s.nv), Vector(s.tau_at(k), s.nv), convention)
               .data();
         }});
  }
  return field;
}
