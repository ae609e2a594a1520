#pragma once
// The compiled simulation as Python holds it, with its drives and wrenches.
#include "arrays.hpp"
#include "linkwise/simulate/evaluation_trace.hpp"
#include "linkwise/simulate/simulation.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {

class PySimulation {
 public:
  PySimulation(const PyModel& owner, SimulationOptions options)
      : model(owner.model), simulation(owner.model, std::move(options)) {}

  std::shared_ptr<const Model> model;
  EvaluationTrace trace;
  Simulation simulation;

  void torque(const std::string& joint, nb::handle values);
  void torque_table(const std::string& joint, nb::handle times, nb::handle values,
                    const std::string& interpolation, bool smooth);
  void torque_callable(const std::string& joint, nb::callable fn, nb::handle breakpoints,
                       nb::handle samples);
  void motion_table(const std::string& joint, nb::handle times, nb::handle values,
                    const std::string& interpolation);
  void motion_callable(const std::string& joint, nb::callable fn, nb::handle breakpoints,
                       nb::handle samples);
  void pd(const std::string& joint, double kp, double kd, nb::handle target);
  void pd_table(const std::string& joint, double kp, double kd, nb::handle times, nb::handle values,
                const std::string& interpolation);
  void locked(const std::string& joint);
  void free(const std::string& joint);
  void wrench(nb::handle at, nb::handle value, const std::string& axes);
  void wrench_table(nb::handle at, nb::handle times, nb::handle values,
                    const std::string& interpolation, const std::string& axes);
  void wrench_callable(nb::handle at, nb::callable fn, const std::string& axes,
                       nb::handle breakpoints, nb::handle samples);
  void keep_extremes(nb::handle directions);
  nb::object extremes();
  void start(double t0, nb::handle q, nb::handle v, std::vector<std::string> hold,
             const std::vector<std::pair<std::string, std::vector<double>>>& loop_rates);

  /// The garbage collector's: a user's function may refer to its own simulation, by the traceback
  /// of an exception for one.
  int traverse(visitproc visit, void* arg) const;
  void clear();

 private:
  std::shared_ptr<PythonFunction> keep(nb::callable fn);
  void set(const std::string& joint, Drive drive);
  size_t width(const std::string& joint) const;

  std::vector<std::weak_ptr<PythonFunction>>
      functions_;  ///< of drives and wrenches, which own them
};

}  // namespace linkwise::bindings
