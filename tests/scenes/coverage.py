"""What scenes cover: parts, keys, and pairs of parts with bodies, regions, criteria and boundaries."""

import itertools

from bodies import SHAPES

BODIES = ("lattice", "jittered", "voronoi", "file")
FILES = ("csv", "h5")
LAWS_THAT_MEET = ("laminate", "parallel")


def part_name(part):
    return part["type"] if isinstance(part, dict) else part


def body_of(scene):
    body = scene["body"]
    shape = body.get("points") or body["lattice"]
    kind = "voronoi" if shape.get("volume") == "voronoi" else "file" if "points" in body else "jittered" if shape.get("jitter") else "lattice"
    return "%s %dD" % (kind, body["dimension"])


def keys_of(value, path):
    """Every key of a scene, without the numbers of its lists; keys of parts by the kind of the part."""
    if isinstance(value, list):
        for item in value:
            yield from keys_of(item, path)
    elif isinstance(value, dict):
        for key, item in value.items():
            yield "%s.%s" % (path, key) if path else key
            yield from keys_of(item, "%s.%s" % (path, key) if path else key)


def features(scene):
    kinematics, integrator = part_name(scene["kinematics"]), part_name(scene["integrator"])
    out = {"key " + key for key in keys_of({name: value for name, value in scene.items() if name not in ("files", "sets")}, "")}
    out |= {"kinematics " + kinematics, "integrator " + integrator, "material " + part_name(scene["material"]),
            "influence " + part_name(scene["family"].get("influence", "constant")), "body " + body_of(scene), "%s, %s" % (kinematics, body_of(scene))}
    if isinstance(scene["kinematics"], dict) and "stabilization" in scene["kinematics"]:
        out.add("stabilization " + part_name(scene["kinematics"]["stabilization"]))
    if "region" in scene:
        shapes = {region["set"].split("_")[0] for region in scene["region"]}
        out |= {"%s, %s" % (kinematics, shape) for shape in shapes & set(SHAPES)}
        out.add("%s, %s" % (kinematics, scene["family"].get("interfaces", "laminate")))
    if "points" in scene["body"]:
        out.add("points " + scene["body"]["points"]["file"].split(".")[-1])
    out |= {"term " + term["type"] for term in scene.get("term", [])}
    if "damage" in scene:
        out |= {"damage " + part_name(scene["damage"]), "%s, %s" % (kinematics, part_name(scene["damage"]))}
    for condition in ("boundary", "symmetry", "periodic", "load"):
        if condition in scene:
            out.add("%s, %s" % (integrator, condition))
    return sorted(out)


def wanted(tables):
    out = {"%s %s" % (kind, name) for kind, parts in tables.parts.items() for name in parts}
    bodies = ["%s %dD" % (kind, d) for kind, d in itertools.product(BODIES, (1, 2, 3)) if not (kind == "voronoi" and d == 1)]
    out |= {"%s, %s" % pair for pair in itertools.product(tables.parts["kinematics"], bodies)}
    out |= {"%s, %s" % pair for pair in itertools.product(tables.parts["kinematics"], tables.parts["damage"])}
    out |= {"%s, %s" % pair for pair in itertools.product(tables.parts["integrator"], ("boundary", "symmetry", "periodic", "load"))}
    out |= {"%s, %s" % pair for pair in itertools.product(tables.parts["kinematics"], SHAPES + LAWS_THAT_MEET)}
    out |= {"points " + kind for kind in FILES} | {"key constants"}
    # Parts stand under sections of their kind.
    out |= {"key %s.%s" % (name, key) for name, table in tables.sections.items() if name not in ("", "sets", "constants") for key in table.keys}
    out |= {"key %s.%s" % (kind, key) for kind in ("kinematics", "material", "damage", "term", "integrator") for table in tables.parts[kind].values()
            for key in table.keys}
    return out
