#include <algorithm>
#include <memory>
#include <mujoco/mujoco.h>
#include <stdexcept>

#include "contestant.hpp"
#include "machine.hpp"

namespace {

struct Shared {
  States states;
  std::unique_ptr<mjModel, decltype(&mj_deleteModel)> model{nullptr, mj_deleteModel};
  std::unique_ptr<mjData, decltype(&mj_deleteData)> data{nullptr, mj_deleteData};
};

}  // namespace

Field make_mujoco(const std::filesystem::path& folder) {
  const auto shared = std::make_shared<Shared>();
  shared->states = read_states(folder, "mujoco");
  shared->model.reset(mj_loadModel((folder / "mujoco.mjb").c_str(), nullptr));
  if (!shared->model) throw std::runtime_error("MuJoCo could not load its model");
  shared->data.reset(mj_makeData(shared->model.get()));
  if (!shared->data) throw std::runtime_error("MuJoCo could not allocate its data");
  Field field;
  field.states = shared->states.count;
  field.contestants.push_back(
      {"mj_forward", 1, 1, false, static_cast<int>(shared->model->nv), [shared](int k) {
         const States& s = shared->states;
         mjData* data = shared->data.get();
         std::copy_n(s.q_at(k), s.nq, data->qpos);
         std::copy_n(s.v_at(k), s.nv, data->qvel);
         std::copy_n(s.tau_at(k), s.nv, data->qfrc_applied);
         mj_forward(shared->model.get(), data);
         return static_cast<const double*>(data->qacc);
       }});
  return field;
}
