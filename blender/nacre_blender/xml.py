"""Scene elements. A child is (tag, attributes, children); values get their own helpers."""

from xml.sax.saxutils import quoteattr


def element(tag, children=(), **attributes):
    return tag, attributes, list(children)


def number(name, value):
    return element("float", name=name, value="%.9g" % value)


def integer(name, value):
    return element("integer", name=name, value=str(int(value)))


def boolean(name, value):
    return element("boolean", name=name, value="true" if value else "false")


def string(name, value):
    return element("string", name=name, value=value)


def rgb(name, color):
    return element("rgb", name=name, value=", ".join("%.9g" % c for c in list(color)[:3]))


def transform(name, matrix):
    values = " ".join("%.9g" % matrix[row][column] for row in range(3) for column in range(4))
    values += " 0 0 0 1"
    return element("transform", [element("matrix", value=values)], name=name)


def to_world(matrix):
    return transform("toWorld", matrix)


def text(item, depth=0):
    tag, attributes, children = item
    indent = "\t" * depth
    head = indent + "<" + tag
    for key, value in attributes.items():
        head += " %s=%s" % (key, quoteattr(value))
    if not children:
        return head + "/>\n"
    return head + ">\n" + "".join(text(child, depth + 1) for child in children) + (
        "%s</%s>\n" % (indent, tag))
