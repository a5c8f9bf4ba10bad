// SPDX-License-Identifier: BSD-3-Clause
#include <unirit/registration.hpp>

#include <iostream>

int main() {
  const unirit::RegistrationSettings settings;
  unirit::validate(settings);
  std::cout << unirit::toJson(settings) << '\n';
  return 0;
}
