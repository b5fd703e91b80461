// scene_keys.h: the keys of a scene file; private to room scene.
#ifndef OM_SCENE_KEYS_H
#define OM_SCENE_KEYS_H

#include "omentum/scene.h"
#include "omentum/scene_yaml.h"

#define OM__SCENE_IN(source) (1u << (source))  // OmYamlField.group of the keys of a scene

extern const OmYamlSchema om__scene_schema;
// What a calibration leaves: the numbers that omentum calibrate may find, none of them required.
extern const OmYamlSchema om__scene_calibrated_schema;
extern const char* const om__scene_source_name[];  // as OmTissueSource orders them, ended by null

#endif
