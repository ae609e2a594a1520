// Times the methods of one engine, on request, without Python in the process. benchmarks/peers.py
// starts one worker an engine, lets them take turns, and talks to each over its standard streams:
//     clear              -> {}, and the last machine is gone
//     build FOLDER       -> {"states": ..., "contestants": [...]}
//     check METHOD FILE  -> accelerations of every state written to FILE
//     time METHOD CALLS  -> {"seconds": ..., "cpu": ...}: of the wall clock, of the threads
//     together memory             -> {"resident": bytes, "peak": bytes}
// FOLDER, METHOD and FILE are lines of their own. A failure is {"error": "..."}.
#include <cstdio>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <sys/resource.h>

#include "contestant.hpp"
#include "timing.hpp"

namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return out + '"';
}

Field build(const std::string& engine, const std::string& folder) {
  if (engine == "linkwise") return make_linkwise(folder);
#ifdef LINKWISE_BENCH_PINOCCHIO
  if (engine == "pinocchio") return make_pinocchio(folder);
#endif
#ifdef LINKWISE_BENCH_MUJOCO
  if (engine == "mujoco") return make_mujoco(folder);
#endif
  throw std::runtime_error("this program was compiled without " + engine);
}

std::string describe(const Field& field) {
  std::string out = "{\"states\": " + std::to_string(field.states) + ", \"contestants\": [";
  const char* comma = "";
  for (const Contestant& c : field.contestants) {
    out += comma + std::string("{\"method\": ") + quoted(c.method) +
           ", \"systems\": " + std::to_string(c.systems) +
           ", \"threads\": " + std::to_string(c.threads) +
           ", \"loads\": " + (c.loads ? "true" : "false") + "}";
    comma = ", ";
  }
  return out + "]}";
}

std::string line() {
  std::string text;
  if (!std::getline(std::cin, text)) throw std::runtime_error("a request was cut short");
  return text;
}

const Contestant& find(const Field& field, const std::string& method) {
  for (const Contestant& c : field.contestants)
    if (c.method == method) return c;
  throw std::runtime_error("no method '" + method + "' here");
}

std::string check(const Field& field) {
  const Contestant& contestant = find(field, line());
  std::ofstream out(line(), std::ios::binary);
  for (int k = 0; k < field.states; k += contestant.systems) {
    const double* found = contestant.evaluate(k);
    out.write(reinterpret_cast<const char*>(found), static_cast<std::streamsize>(sizeof(double)) *
                                                        contestant.systems *
                                                        contestant.acceleration_count);
  }
  return "{}";
}

std::string time(const Field& field) {
  const Contestant& contestant = find(field, line());
  const long calls = std::stol(line());
  const Taken taken =
      timed(calls, [&](long i) { contestant.evaluate(static_cast<int>(i % field.states)); });
  char text[96];
  std::snprintf(text, sizeof text, "{\"seconds\": %.9g, \"cpu\": %.9g}", taken.seconds, taken.cpu);
  return text;
}

/// Not getrusage: its peak is that of whatever process started this one.
std::string memory() {
  std::ifstream status("/proc/self/status");
  long resident = 0, peak = 0;
  for (std::string word; status >> word;) {
    if (word == "VmRSS:") status >> resident;
    if (word == "VmHWM:") status >> peak;
  }
  return "{\"resident\": " + std::to_string(resident * 1024) +
         ", \"peak\": " + std::to_string(peak * 1024) + "}";
}

std::string answer(const std::string& engine, const std::string& request, Field& field) {
  try {
    if (request == "clear") {
      field = {};
      return "{}";
    }
    if (request == "build") {
      field = build(engine, line());
      return describe(field);
    }
    if (request == "check") return check(field);
    if (request == "time") return time(field);
    if (request == "memory") return memory();
    return "{\"error\": \"unknown request\"}";
  } catch (const std::bad_alloc&) {
    return "{\"error\": \"out of memory\"}";
  } catch (const std::exception& error) {
    return "{\"error\": " + quoted(error.what()) + "}";
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: linkwise_bench ENGINE BYTES_OF_MEMORY\n");
    return 2;
  }
  const rlim_t bytes = std::stoull(argv[2]);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_DATA, &limit);
  // The system's memory may run out all the same; then it is this process that has to go.
  std::ofstream("/proc/self/oom_score_adj") << 1000;
  Field field;
  for (std::string request; std::getline(std::cin, request);)
    std::cout << answer(argv[1], request, field) << std::endl;
  return 0;
}
