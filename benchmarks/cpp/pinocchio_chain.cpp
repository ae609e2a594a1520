#include "pinocchio_chain.hpp"

#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/multibody.hpp>
#include <string>

using Vector = Eigen::Map<const Eigen::VectorXd>;

struct PinocchioChain::Impl {
  pinocchio::Model model;
  std::unique_ptr<pinocchio::Data> data;
};

PinocchioChain::PinocchioChain(const std::vector<ChainLink>& chain) : impl_(new Impl) {
  pinocchio::JointIndex joint = 0;
  for (size_t i = 0; i < chain.size(); ++i) {
    const ChainLink& link = chain[i];
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(
        link.rotation.data());
    const Eigen::Vector3d translation(link.translation.data()), com(link.com.data()),
        inertia(link.inertia.data());
    const pinocchio::SE3 placement(rotation, translation);
    joint = impl_->model.addJoint(joint, pinocchio::JointModelRZ(), placement,
                                  "joint" + std::to_string(i));
    const Eigen::Matrix3d central = inertia.asDiagonal();
    impl_->model.appendBodyToJoint(joint, {link.mass, com, central}, pinocchio::SE3::Identity());
  }
  impl_->data = std::make_unique<pinocchio::Data>(impl_->model);
}

PinocchioChain::~PinocchioChain() = default;

const double* PinocchioChain::aba(const double* q, const double* v, const double* tau, bool world) {
  const int n = impl_->model.nv;
  const auto convention = world ? pinocchio::Convention::WORLD : pinocchio::Convention::LOCAL;
  return pinocchio::aba(impl_->model, *impl_->data, Vector(q, n), Vector(v, n), Vector(tau, n),
                        convention)
      .data();
}
