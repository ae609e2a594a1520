#include "linkwise/model/spec.hpp"

#include "linkwise/base/error.hpp"

namespace linkwise {
namespace {

constexpr const char* note_levels[] = {"merge", "warning", "info"};

}  // namespace

DofProperty dof_property_from_name(const std::string& name) {
  for (int p = 0; p < n_dof_properties; ++p)
    if (name == dof_property_table[p].name) return static_cast<DofProperty>(p);
  throw InputError("property '" + name + "' is unknown; see ModelBuilder.add_joint");
}

const char* note_level_name(NoteLevel level) { return note_levels[static_cast<int>(level)]; }

NoteLevel note_level_from_name(const std::string& name) {
  for (NoteLevel level : {NoteLevel::merge, NoteLevel::warning, NoteLevel::info})
    if (name == note_level_name(level)) return level;
  throw InputError("note level '" + name + "' is unknown; known: merge, warning, info");
}

}  // namespace linkwise
