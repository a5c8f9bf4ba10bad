// SPDX-License-Identifier: BSD-3-Clause
#include "parameter_names.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace unirit {
namespace {

/// Letters that may be wrong in a name that is meant all the same.
std::size_t tolerance(const std::string& name) { return std::max<std::size_t>(2, name.size() / 4); }

void collectLeaves(XmlRpc::XmlRpcValue& tree, const std::string& prefix,
                   std::set<std::string>& names) {
  for (auto& [name, value] : tree) {
    if (value.getType() == XmlRpc::XmlRpcValue::TypeStruct) {
      collectLeaves(value, prefix + name + "/", names);
    } else {
      names.insert(prefix + name);
    }
  }
}

/// Fewest letters to put in, take out or change (Levenshtein).
std::size_t editDistance(const std::string& from, const std::string& to) {
  std::vector<std::size_t> row(to.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < from.size(); ++i) {
    std::size_t diagonal = row[0]++;
    for (std::size_t j = 0; j < to.size(); ++j) {
      const std::size_t changed = diagonal + (from[i] == to[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string withoutNamespace(const std::string& name) { return name.substr(name.rfind('/') + 1); }

}  // namespace

std::set<std::string> leafNames(XmlRpc::XmlRpcValue tree) {
  std::set<std::string> names;
  if (tree.getType() == XmlRpc::XmlRpcValue::TypeStruct) collectLeaves(tree, "", names);
  return names;
}

std::string nearestName(const std::string& unknown, const std::set<std::string>& known) {
  std::string nearest;
  std::size_t fewest = tolerance(unknown) + 1;
  for (const std::string& name : known) {
    const std::size_t changes =
        std::min(editDistance(unknown, name), editDistance(unknown, withoutNamespace(name)));
    if (changes >= fewest) continue;
    fewest = changes;
    nearest = name;
  }
  return nearest;
}

bool isInNamespaceOf(const std::string& name, const std::set<std::string>& known) {
  const std::string first = name.substr(0, name.find('/')) + "/";
  return std::any_of(known.begin(), known.end(), [&](const std::string& other) {
    return other.compare(0, first.size(), first) == 0;
  });
}

}  // namespace unirit
