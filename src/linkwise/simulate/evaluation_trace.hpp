#pragma once
// A record of the evaluations that an integrator asks for, with the time that each takes.
#include <chrono>
#include <vector>

#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

class EvaluationTrace final : public EvaluationObserver {
 public:
  struct Row {
    double time = 0;     ///< simulated
    double seconds = 0;  ///< spent on accelerations and joint loads, drives left out
    int iterations = 0;
    bool accepted = false;  ///< the last evaluation of an accepted step
  };

  const std::vector<Row>& rows() const { return rows_; }

  void started() override { rows_.clear(); }
  DynamicsReport evaluate(double t, const std::function<DynamicsReport()>& evaluation) override {
    const auto started = std::chrono::steady_clock::now();
    const DynamicsReport report = evaluation();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - started;
    rows_.push_back({t, spent.count(), report.iterations, false});
    return report;
  }
  void accepted() override {
    if (!rows_.empty()) rows_.back().accepted = true;
  }

 private:
  std::vector<Row> rows_;
};

}  // namespace linkwise
