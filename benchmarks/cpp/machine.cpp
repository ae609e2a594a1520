#include "machine.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>

namespace {

std::ifstream open(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return stream;
}

void read(std::istream& stream, std::vector<double>& values, size_t count) {
  values.resize(count);
  stream.read(reinterpret_cast<char*>(values.data()),
              static_cast<std::streamsize>(count * sizeof(double)));
  if (!stream) throw std::runtime_error("the file of states is too short");
}

}  // namespace

Machine read_machine(const std::filesystem::path& folder) {
  std::ifstream stream = open(folder / "machine.txt");
  Machine machine;
  size_t count = 0;
  stream >> machine.gravity[0] >> machine.gravity[1] >> machine.gravity[2] >> count;
  machine.bodies.resize(count);
  for (Body& body : machine.bodies) {
    stream >> body.parent >> body.joint;
    for (double& x : body.axis) stream >> x;
    for (double& x : body.rotation) stream >> x;
    for (double& x : body.translation) stream >> x;
    stream >> body.mass;
    for (double& x : body.com) stream >> x;
    for (double& x : body.inertia) stream >> x;
  }
  if (!stream) throw std::runtime_error("machine.txt is damaged");
  return machine;
}

States read_states(const std::filesystem::path& folder, const std::string& engine) {
  std::ifstream stream = open(folder / (engine + ".states"));
  std::vector<double> header;
  read(stream, header, 3);
  States states;
  states.count = static_cast<int>(header[0]);
  states.nq = static_cast<int>(header[1]);
  states.nv = static_cast<int>(header[2]);
  const auto count = static_cast<size_t>(states.count);
  read(stream, states.q, count * states.nq);
  read(stream, states.v, count * states.nv);
  read(stream, states.tau, count * states.nv);
  return states;
}

std::string read_bytes(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << open(file).rdbuf();
  return std::move(bytes).str();
}
