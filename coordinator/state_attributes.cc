// SPDX-License-Identifier: GPL-3.0-or-later
// The lists of attributes of maps, and the jobs that change them.
#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "coordinator/state.h"
#include "service/attributes.h"

namespace ndmap::coordinator {
namespace {

using AttributeList = google::protobuf::RepeatedPtrField<v1::Attribute>;

AttributeList::const_iterator Find(const AttributeList& list, const std::string& name) {
  return std::find_if(list.begin(), list.end(), [&](const v1::Attribute& a) { return a.name() == name; });
}

absl::StatusOr<v1::Phase> PhaseFor(const AttributeList& list) {
  std::vector<AttributeDefinition> definitions;
  for (const v1::Attribute& attribute : list) {
    absl::StatusOr<AttributeDefinition> definition = service::DefinitionFromWire(attribute);
    if (!definition.ok()) return definition.status();
    definitions.push_back(*std::move(definition));
  }
  v1::Phase phase;
  phase.set_algorithm(kAttributesAlgorithm);
  (*phase.mutable_parameters())["definitions"] = EncodeDefinitions(definitions);
  return phase;
}

}  // namespace

absl::Status State::AppendAttributes(const v1::Map& map, std::vector<v1::Phase>& phases) const {
  if (map.attributes().empty()) return absl::OkStatus();
  absl::StatusOr<v1::Phase> phase = PhaseFor(map.attributes());
  if (!phase.ok()) return phase.status();
  phases.push_back(*std::move(phase));
  return absl::OkStatus();
}

absl::StatusOr<v1::Job> State::NewAttributesJob(const v1::Map& map, const std::string& kind,
                                                AttributeList list) {
  absl::StatusOr<v1::Phase> phase = PhaseFor(list);
  if (!phase.ok()) return phase.status();
  v1::Job job = NewJob(map.map(), kind, true, {*std::move(phase)});
  jobs_.at(job.job())->attributes = std::move(list);
  return job;
}

absl::StatusOr<v1::Job> State::DefineAttribute(const std::string& name, const v1::Attribute& attribute) {
  absl::StatusOr<AttributeDefinition> definition = service::DefinitionFromWire(attribute);
  if (!definition.ok()) return definition.status();
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<v1::Map*> map = FindToRun(name, true);
  if (!map.ok()) return map.status();
  AttributeList list = (*map)->attributes();
  if (Find(list, attribute.name()) != list.end()) {
    return absl::AlreadyExistsError(
        absl::StrCat("map \"", name, "\" has an attribute ", attribute.name(), " already"));
  }
  if (list.size() >= static_cast<int>(AttributeDefinition::kMaxAttributes)) {
    return absl::ResourceExhaustedError(absl::StrCat("map \"", name, "\" has ", list.size(),
                                                     " attributes, no more are possible: drop one first"));
  }
  // Never the same in two lives of the coordinator, as the numbers of maps.
  definition->number = ++last_incarnation_;
  service::ToWire(*definition, *list.Add());
  return NewAttributesJob(**map, "define attribute", std::move(list));
}

absl::StatusOr<v1::Job> State::DropAttribute(const std::string& name, const std::string& attribute) {
  absl::MutexLock lock(&mutex_);
  absl::StatusOr<v1::Map*> map = FindToRun(name, true);
  if (!map.ok()) return map.status();
  AttributeList list = (*map)->attributes();
  const auto there = Find(list, attribute);
  if (there == list.end()) {
    const std::string names = absl::StrJoin(
        list, ", ", [](std::string* out, const v1::Attribute& a) { absl::StrAppend(out, a.name()); });
    return absl::NotFoundError(absl::StrCat("map \"", name, "\" has no attribute \"",
                                            attribute.substr(0, 128), "\"; it has ",
                                            names.empty() ? "none" : names));
  }
  list.erase(there);
  return NewAttributesJob(**map, "drop attribute", std::move(list));
}

}  // namespace ndmap::coordinator
