// SPDX-License-Identifier: BSD-3-Clause
#include "parameters.hpp"

#include <set>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "parameter_names.hpp"
#include "refusal.hpp"
#include "result_message.hpp"

namespace unirit {
namespace {

using XmlRpc::XmlRpcValue;

struct List {
  std::size_t length;
  const char* what;
};
constexpr List kPose{7, "the 7 numbers x y z qx qy qz qw"};
constexpr List kBox{6, "the 6 numbers x y z x y z of two corners"};

template <class Value>
constexpr XmlRpcValue::Type typeOf() {
  if (std::is_same_v<Value, bool>) return XmlRpcValue::TypeBoolean;
  if (std::is_same_v<Value, int>) return XmlRpcValue::TypeInt;
  if (std::is_same_v<Value, double>) return XmlRpcValue::TypeDouble;
  return XmlRpcValue::TypeString;
}

template <class Value>
constexpr const char* nameOfType() {
  if (std::is_same_v<Value, bool>) return "true or false";
  if (std::is_same_v<Value, int>) return "a whole number";
  if (std::is_same_v<Value, double>) return "a number";
  return "a string";
}

/// What libraries that work within the node look for in its namespace.
const std::set<std::string>& namesOfOthers() {
  static const std::set<std::string> names{"diagnostic_period", "num_worker_threads", "tf_prefix"};
  return names;
}

/// Reads parameters one by one, keeps the default of an absent one and notes faults.
class Reader {
 public:
  Reader(const ros::NodeHandle& nh, Parameters& parameters) : nh_(nh), parameters_(parameters) {}

  template <class Value>
  void read(const std::string& name, Value& value) {
    known_.insert(name);
    XmlRpcValue given;
    if (!nh_.getParam(name, given)) return;
    if (std::is_same_v<Value, double> && given.getType() == XmlRpcValue::TypeInt) {
      given = XmlRpcValue(static_cast<double>(static_cast<int>(given)));
    }
    if (given.getType() != typeOf<Value>()) {
      fault(name, std::string("is not ") + nameOfType<Value>());
      return;
    }
    value = static_cast<Value&>(given);
  }

  template <class Number>
  void readNumber(const std::string& name, Number& value, Number minimum, Number maximum) {
    Number given = value;
    read(name, given);
    if (given >= minimum && given <= maximum) {  // false for NaN
      value = given;
      return;
    }
    std::ostringstream range;
    range << "is " << given << ", outside [" << minimum << ", " << maximum << "]";
    fault(name, range.str());
  }

  /// `parse` throws std::invalid_argument on a word it does not know.
  template <class Parse>
  void readWord(const std::string& name, std::string word, Parse&& parse) {
    read(name, word);
    try {
      parse(word);
    } catch (const std::invalid_argument& error) {
      fault(name, std::string("cannot be used: ") + error.what());
    }
  }

  void readPose(const std::string& name, std::optional<Eigen::Isometry3d>& pose) {
    const std::vector<double> numbers = readList(name, kPose);
    if (numbers.empty()) return;
    geometry_msgs::Pose message;
    message.position.x = numbers[0];
    message.position.y = numbers[1];
    message.position.z = numbers[2];
    message.orientation.x = numbers[3];
    message.orientation.y = numbers[4];
    message.orientation.z = numbers[5];
    message.orientation.w = numbers[6];
    try {
      pose = fromMessage(message, "it");
    } catch (const Refusal& refusal) {
      fault(name, std::string("cannot be used: ") + refusal.what());
    }
  }

  void readBox(const std::string& name, std::optional<Eigen::AlignedBox3d>& box) {
    const std::vector<double> numbers = readList(name, kBox);
    if (numbers.empty()) return;
    const Eigen::Map<const Eigen::Vector3d> a(numbers.data()), b(numbers.data() + 3);
    if (a.allFinite() && b.allFinite()) {
      box.emplace(a.cwiseMin(b), a.cwiseMax(b));
    } else {
      fault(name, "is not finite");
    }
  }

  /// To be called after all others: what was given beyond them.
  void noteUnknown() {
    XmlRpcValue tree;
    nh_.getParam(nh_.getNamespace(), tree);
    for (const std::string& name : leafNames(tree)) {
      if (known_.count(name) > 0 || namesOfOthers().count(name) > 0) continue;
      const std::string meant = nearestName(name, known_);
      if (!meant.empty()) {
        fault(name, "is unknown; the nearest known one is " + meant);
      } else if (isInNamespaceOf(name, known_)) {
        fault(name, "is unknown");
      } else {
        parameters_.warnings.push_back(sentence(name, "is unknown and has no effect"));
      }
    }
  }

 private:
  /// Empty where the list is absent, empty or not as it should be.
  std::vector<double> readList(const std::string& name, const List& list) {
    known_.insert(name);
    std::vector<double> numbers;
    if (!nh_.hasParam(name)) return {};
    const bool is_list = nh_.getParam(name, numbers);
    if (is_list && (numbers.empty() || numbers.size() == list.length)) return numbers;
    fault(name, std::string("is not a list of ") + list.what);
    return {};
  }

  std::string sentence(const std::string& name, const std::string& what) const {
    return "parameter " + nh_.resolveName(name) + " " + what;
  }

  void fault(const std::string& name, const std::string& what) {
    parameters_.faults.push_back(sentence(name, what));
  }

  ros::NodeHandle nh_;
  Parameters& parameters_;
  std::set<std::string> known_;
};

void readNodeSettings(Reader& reader, NodeSettings& node) {
  reader.read("weights", node.weights);
  reader.read("auto_register", node.auto_register);
  reader.read("every_cloud", node.every_cloud);
  reader.readNumber("stale_after", node.stale_after, 0.1, 3600.0);
  reader.readPose("initial_pose", node.initial_pose);
  reader.readWord("initial_alignment", node.initial_alignment, [&](const std::string& word) {
    if (word != "centroid" && word != "none") {
      throw std::invalid_argument("unknown alignment '" + word + "', known are centroid, none");
    }
    node.initial_alignment = word;
  });
  reader.readBox("preprocessing/region", node.region);
  reader.read("preprocessing/region_frame", node.region_frame);
  reader.read("fixed_frame", node.fixed_frame);
  reader.read("sensor_frame", node.sensor_frame);
  reader.read("publish_tf", node.publish_tf);
  reader.read("invert_tf", node.invert_tf);
  reader.readNumber("tf_rate", node.tf_rate, 0.1, 1000.0);
  reader.readNumber("tf_timeout", node.tf_timeout, 0.0, 60.0);
}

}  // namespace

Parameters readParameters(const ros::NodeHandle& private_nh) {
  Parameters parameters;
  Reader reader(private_nh, parameters);
  auto& registration = parameters.registration;
  visitSettings(registration,
                [&](const char* name, auto& value, auto minimum, auto maximum, const char*) {
                  reader.readNumber(name, value, minimum, maximum);
                });
  for (const WordSetting& word : wordSettings()) {
    reader.readWord(word.name, word.get(registration),
                    [&](const std::string& value) { word.set(registration, value); });
  }
  readNodeSettings(reader, parameters.node);
  reader.noteUnknown();
  return parameters;
}

PlausibilitySettings fromConfig(const UniritConfig& config) {
  PlausibilitySettings settings;
  settings.min_points = config.min_points;
  settings.min_thickness = config.min_thickness;
  settings.min_organ_extent = config.min_organ_extent;
  settings.max_organ_extent = config.max_organ_extent;
  settings.min_extent_ratio = config.min_extent_ratio;
  settings.max_extent_ratio = config.max_extent_ratio;
  settings.min_overlap = config.min_overlap;
  settings.inlier_tolerance = config.inlier_tolerance;
  settings.max_residual = config.max_residual;
  settings.max_residual_p95 = config.max_residual_p95;
  settings.min_inliers = config.min_inliers;
  settings.max_residual_left = config.max_residual_left;
  settings.max_missing = config.max_missing;
  settings.min_confidence = config.min_confidence;
  settings.max_surprise = config.max_surprise;
  settings.max_flip_gain = config.max_flip_gain;
  settings.max_displacement = config.max_displacement;
  settings.max_stretch = config.max_stretch;
  settings.min_compression = config.min_compression;
  settings.max_folded = config.max_folded;
  settings.max_turn = config.max_turn;
  settings.max_joint = config.max_joint;
  settings.max_jump_translation = config.max_jump_translation;
  settings.max_jump_rotation = config.max_jump_rotation;
  return settings;
}

}  // namespace unirit
