"""Formulas of the site as MathML, which browsers render without scripts and network."""

from __future__ import annotations

from typing import Any

from docutils import nodes

from airmuscle.report.formulas import to_display_mathml, to_mathml


def set_up_mathml(app: Any) -> None:
    """Register the renderer `mathml`."""
    app.add_html_math_renderer(
        "mathml", inline_renderers=(_inline, None), block_renderers=(_block, None)
    )


def _inline(translator: Any, node: Any) -> None:
    formula = to_mathml(rf"\({node.astext()}\)")
    translator.body.append(f'<span class="formula">{formula}</span>')
    raise nodes.SkipNode


def _block(translator: Any, node: Any) -> None:
    translator.body.append(
        f'<div class="formula" tabindex="0">{to_display_mathml(node.astext())}</div>\n'
    )
    raise nodes.SkipNode
