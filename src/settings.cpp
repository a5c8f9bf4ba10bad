// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/settings.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "unirit/hash.hpp"

namespace unirit {
namespace {

constexpr std::array<Stage, 3> kStages{Stage::kRigid, Stage::kNonRigid, Stage::kRefine};
constexpr std::array<Pairing, 4> kPairings{Pairing::kNearest, Pairing::kOffsets, Pairing::kNone,
                                           Pairing::kRow};

Stage stageFromString(const std::string& name) {
  for (const Stage stage : kStages) {
    if (name == toString(stage)) return stage;
  }
  throw std::invalid_argument("stages: unknown stage '" + name +
                              "', known are rigid, nonrigid, refine");
}

}  // namespace

const char* toString(Pairing pairing) {
  switch (pairing) {
    case Pairing::kNearest:
      return "nearest";
    case Pairing::kOffsets:
      return "offsets";
    case Pairing::kNone:
      return "none";
    case Pairing::kRow:
      return "row";
  }
  return "unknown";
}

const char* toString(Correspondence correspondence) {
  return correspondence == Correspondence::kSurface ? "surface" : "points";
}

const char* toString(Stage stage) {
  switch (stage) {
    case Stage::kRigid:
      return "rigid";
    case Stage::kNonRigid:
      return "nonrigid";
    case Stage::kRefine:
      return "refine";
  }
  return "unknown";
}

std::string toString(const std::vector<Stage>& stages) {
  std::string names;
  for (const Stage stage : stages)
    names += (names.empty() ? "" : ",") + std::string(toString(stage));
  return names;
}

Pairing pairingFromString(const std::string& name) {
  for (const Pairing pairing : kPairings) {
    if (name == toString(pairing)) return pairing;
  }
  throw std::invalid_argument("pairing: unknown pairing '" + name +
                              "', known are nearest, offsets, none, row");
}

Correspondence correspondenceFromString(const std::string& name) {
  for (const auto correspondence : {Correspondence::kSurface, Correspondence::kPoints}) {
    if (name == toString(correspondence)) return correspondence;
  }
  throw std::invalid_argument("correspondence: unknown correspondence '" + name +
                              "', known are surface, points");
}

bool RegistrationSettings::runs(Stage stage) const {
  return std::find(stages.begin(), stages.end(), stage) != stages.end();
}

std::vector<Stage> stagesFromString(const std::string& comma_separated) {
  std::vector<Stage> stages;
  std::istringstream words(comma_separated);
  for (std::string word; std::getline(words, word, ',');) {
    const Stage stage = stageFromString(word);
    if (!stages.empty() && stage <= stages.back()) {
      throw std::invalid_argument("stages: '" + comma_separated + "' is out of order or repeats");
    }
    stages.push_back(stage);
  }
  if (stages.empty())
    throw std::invalid_argument("stages: none given, known are rigid, nonrigid, refine");
  return stages;
}

const std::vector<WordSetting>& wordSettings() {
  using Settings = RegistrationSettings;
  using Word = const std::string&;
  static const std::vector<WordSetting> words{
      {"stages", [](const Settings& s) { return toString(s.stages); },
       [](Settings& s, Word word) { s.stages = stagesFromString(word); }},
      {"network/pairing",
       [](const Settings& s) { return std::string(toString(s.network.pairing)); },
       [](Settings& s, Word word) { s.network.pairing = pairingFromString(word); }},
      {"refinement/correspondence",
       [](const Settings& s) { return std::string(toString(s.refinement.correspondence)); },
       [](Settings& s, Word word) {
         s.refinement.correspondence = correspondenceFromString(word);
       }}};
  return words;
}

void validate(const RegistrationSettings& settings) {
  if (settings.stages.empty()) throw std::invalid_argument("stages: none given");
  visitSettings(
      settings, [](const char* name, auto value, auto minimum, auto maximum, const char*) {
        if (value >= minimum && value <= maximum) return;  // false for NaN
        std::ostringstream sentence;
        sentence << name << ": " << value << " is outside [" << minimum << ", " << maximum << "]";
        throw std::invalid_argument(sentence.str());
      });
}

std::string toJson(const RegistrationSettings& settings) {
  nlohmann::json json;
  for (const WordSetting& word : wordSettings()) json[word.name] = word.get(settings);
  visitSettings(settings,
                [&](const char* name, auto value, auto, auto, const char*) { json[name] = value; });
  return json.dump();
}

std::string sha256(const RegistrationSettings& settings) { return sha256Hex(toJson(settings)); }

}  // namespace unirit
