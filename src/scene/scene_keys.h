// scene_keys.h: the keys of a scene file; private to room scene.
#ifndef OM_SCENE_KEYS_H
#define OM_SCENE_KEYS_H

#include "omentum/scene.h"
#include "omentum/scene_yaml.h"

// OmYamlField.group: the sources for which a key has an effect
#define OM__SCENE_IN(source) (1u << (source))

extern const OmYamlSchema om__scene_schema;
// Results of a calibration: the numbers that omentum calibrate may find, none of them required.
extern const OmYamlSchema om__scene_calibrated_schema;
extern const char* const om__scene_source_name[];  // in the order of OmTissueSource, ended by null

#endif
