#include "linkwise/paper/serial_part.hpp"

namespace linkwise {

SerialPart::SerialPart(const Model& model, const double* q, const double* v)
    : model_(model),
      state_(model.n_bodies()),
      own_(model.n_bodies()),
      velocity_(model.n_bodies()),
      part_(model.n_bodies()) {
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  std::vector<GeneralState<double>> general(model.n_general);
  calc_body_states(model, in, state_.data(), general.data());
  for (int i = 0; i < model.n_bodies(); ++i) {
    const int parent = model.topology[i].parent;
    const Motion<double> carried = parent >= 0 ? state_[i].X * state_[parent].v : Motion<double>{};
    own_[i] = {state_[i].v.lin - carried.lin, state_[i].v.ang - carried.ang};
    part_[i] = 1.0 / (i + 1);
  }
}

void SerialPart::add(int sums) {
  for (int s = 0; s < sums; ++s) {
    double sum = zero_;
    for (const double part : part_) sum += part;
    sum_ = sum;
  }
}

void SerialPart::pass_velocities() {
  own_[0].ang.x += zero_;
  for (size_t i = 0; i < own_.size(); ++i) {
    const int parent = model_.topology[i].parent;
    velocity_[i] = own_[i];
    if (parent >= 0) velocity_[i] += state_[i].X * velocity_[parent];
  }
}

}  // namespace linkwise
