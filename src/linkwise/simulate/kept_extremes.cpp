#include "linkwise/simulate/kept_extremes.hpp"

#include <utility>

namespace linkwise {

KeptExtremes::KeptExtremes(const Setup& setup, size_t members, const double* tau,
                           const std::vector<double>& directions, StateAt state_at)
    : members_(members),
      nq_(setup.model->nq()),
      nv_(setup.model->nv()),
      state_at_(std::move(state_at)) {
  for (size_t i = 0; i < members; ++i)
    of_.emplace_back(setup, tau ? tau + i * nv_ : nullptr, directions);
}

void KeptExtremes::begin(double t, const std::vector<double>& y) {
  const double* const rates = y.data() + members_ * nq_;
  for (size_t i = 0; i < members_; ++i) of_[i].begin(t, y.data() + i * nq_, rates + i * nv_);
  until_ = t;
}

/// From where extremes were kept until t.
void KeptExtremes::interpolate_step(double t) {
  middle_ = state_at_(until_ + (t - until_) / 2);
  end_ = state_at_(t);
}

void KeptExtremes::add(size_t member, double t, bool breaks, Extremes& to) const {
  const size_t q = member * nq_, v = members_ * nq_ + member * nv_;
  to.add_step(middle_.data() + q, middle_.data() + v, t, end_.data() + q, end_.data() + v, breaks);
}

void KeptExtremes::add_step(double t, bool breaks, std::span<const Ending> endings) {
  if (!(t > until_)) return;
  interpolate_step(t);
  for (size_t i = 0; i < members_; ++i)
    if (endings[i].ok()) add(i, t, breaks, of_[i]);
  until_ = t;
}

std::vector<double> KeptExtremes::found(size_t member, double t, bool running, bool loads_open) {
  of_[member].trim();
  Extremes whole = of_[member];
  if (t > until_ && running) {
    interpolate_step(t);
    add(member, t, false, whole);
  }
  if (loads_open) whole.leave_loads_open();
  return std::move(whole).found();
}

}  // namespace linkwise
